#include "host_tools/kmax/terminal.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <sstream>
#include <stdexcept>

#include "tests/host_tools/thrown_message.hpp"

namespace kmax::cli::terminal_test {

using host_tools_test::thrown_message;

class GivenUp : public std::runtime_error {
 public:
  GivenUp() : std::runtime_error("given up") {}
};

/// A pipe in the place of standard input.
class Prompter : public testing::Test {
 protected:
  Prompter() : before_(dup(STDIN_FILENO)) {
    int ends[2] = {-1, -1};
    if (pipe(ends) != 0 || dup2(ends[0], STDIN_FILENO) < 0) throw std::runtime_error("no pipe");
    close(ends[0]);
    keys_ = ends[1];
  }
  ~Prompter() override {
    hang_up();
    if (before_ >= 0) {
      dup2(before_, STDIN_FILENO);
      close(before_);
    }
  }

  void type(const std::string& text) {
    ASSERT_EQ(write(keys_, text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }
  void hang_up() {
    if (keys_ >= 0) close(keys_);
    keys_ = -1;
  }
  void ask() { prompter.ask("touch the wall"); }
  std::string refusal() {
    return thrown_message<bench::Interrupted>([&] { ask(); });
  }

  std::ostringstream out, messages;
  Context context{out, messages, {}};
  int checks = 0, patience = 1000;
  TerminalPrompter prompter{context,
                            [this] {
                              if (++checks > patience) throw GivenUp();
                            },
                            "call somebody"};

 private:
  int before_, keys_ = -1;
};

TEST_F(Prompter, EnterIsAnAnswer) {
  type("\n");
  ask();
  EXPECT_EQ(messages.str(), "kmax: touch the wall, then press Enter\n");
  EXPECT_EQ(out.str(), "") << "results only";
  type("yes, of course\n");
  ask();
}

// The stream stays open: what came with the first answer must not be lost in a buffer.
TEST_F(Prompter, EachEnterAnswersOneQuestion) {
  type("\n\n\n");
  for (int question = 0; question < 3; ++question) ask();
  patience = checks + 2;
  EXPECT_THROW(ask(), GivenUp) << "nobody has answered a fourth time";
}

TEST_F(Prompter, ALineThatIsNotEndedYetIsNoAnswer) {
  type("ye");
  patience = 5;
  EXPECT_THROW(ask(), GivenUp);
}

TEST_F(Prompter, TheEndOfInputIsNobody) {
  hang_up();
  EXPECT_EQ(refusal(), "nobody answered: call somebody");
  EXPECT_EQ(refusal(), "nobody answered: call somebody") << "each time";
}

TEST_F(Prompter, AnAnswerBeforeTheEndCounts) {
  type("\nlast line");
  hang_up();
  ask();
  ask();
  EXPECT_EQ(refusal(), "nobody answered: call somebody");
}

TEST_F(Prompter, AClosedStreamIsNobody) {
  close(STDIN_FILENO);
  EXPECT_EQ(refusal(), "nobody answered: call somebody");
}

// Ctrl-C is seen even while somebody leans on the keyboard.
TEST_F(Prompter, TheCheckMayGiveUpAtAnyTime) {
  type(std::string(100, 'x') + "\n");
  patience = 10;
  EXPECT_THROW(ask(), GivenUp);
  patience = 0;
  EXPECT_THROW(ask(), GivenUp);
}

}  // namespace kmax::cli::terminal_test
