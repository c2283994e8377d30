#include "host_tools/plot/gnuplot_picture.hpp"

#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::plot::gnuplot_picture_test {

using host_tools_test::TemporaryFolder;
using host_tools_test::thrown_message;

constexpr PictureSize size{321, 123};
const std::string line = "set key off\nplot x";

/// There for as long as a picture is drawn.
class WorkingFolder {
 public:
  explicit WorkingFolder(const std::filesystem::path& path) { std::filesystem::current_path(path); }
  ~WorkingFolder() { std::filesystem::current_path(before_); }
  WorkingFolder(const WorkingFolder&) = delete;
  WorkingFolder& operator=(const WorkingFolder&) = delete;

 private:
  std::filesystem::path before_ = std::filesystem::current_path();
};

TEST(GnuplotPicture, HasTheKindOfItsEndingAndItsSize) {
  const TemporaryFolder folder;
  draw_picture(line, size, folder / "a.svg");
  EXPECT_CONTAINS(folder.read("a.svg"), "width=\"321\" height=\"123\"");
  EXPECT_CONTAINS(folder.read("a.svg"), "</svg>");
  draw_picture(line, size, folder / "a.png");
  const std::string png = folder.read("a.png");
  EXPECT_EQ(png.substr(1, 3), "PNG");
  // PNG specification, 11.2.2: width and height are the first two big-endian words of IHDR.
  EXPECT_EQ(png.substr(16, 8), std::string("\0\0\x01\x41\0\0\0\x7B", 8));
  EXPECT_EQ(folder.entries(), 2u) << "something was left behind";
}

TEST(GnuplotPicture, NamesThatCannotBePicturesAreRefused) {
  const TemporaryFolder folder;
  for (const char* name : {"a.gif", "a", "a.SVG", "svg", ".svg", "a.svg.part"}) {
    EXPECT_CONTAINS(thrown_message<PictureNameError>([&] { require_picture_name(folder / name); }),
                    "must end in .svg or .png");
    EXPECT_CONTAINS(thrown_message<PictureNameError>([&] { draw_picture(line, size, folder / name); }),
                    "must end in .svg or .png");
  }
  EXPECT_CONTAINS(thrown_message<PictureNameError>([&] { draw_picture(line, size, folder / "no/a.svg"); }),
                  "no does not exist");
  EXPECT_EQ(folder.entries(), 0u);
  EXPECT_NO_THROW(require_picture_name("a.svg")) << "in the folder at work";
  EXPECT_NO_THROW(require_picture_name(folder / "a.png"));
}

TEST(GnuplotPicture, FilesKeepTheirNames) {
  const TemporaryFolder folder;
  const WorkingFolder here(folder.path());
  for (const char* name : {"'a'.svg", "a''b.svg", "it's `a` \"name\".svg", " a.png", "-a.svg", "$a;b.svg"}) {
    draw_picture(line, size, name);
    EXPECT_FALSE(folder.read(name).empty()) << name;
  }
  EXPECT_EQ(folder.entries(), 6u);
}

TEST(GnuplotPicture, QuotedTextIsOnlyText) {
  const TemporaryFolder folder;
  const std::string touch = "touch " + (folder / "done").string();
  std::size_t number = 0;
  for (const std::string& text :
       {"`" + touch + "`", "'; system('" + touch + "') '", "''; system('" + touch + "'); '",
        "x\nsystem('" + touch + "')", "x'\rsystem('" + touch + "')", "\"; system(\"" + touch + "\") # \\",
        std::string("'"), std::string("\\"), std::string()}) {
    draw_picture("set title " + quoted(text) + "\n" + line, size,
                 folder / (std::to_string(number++) + ".svg"));
    EXPECT_FALSE(std::filesystem::exists(folder / "done")) << text;
  }
  EXPECT_EQ(folder.entries(), number);
}

// gnuplot reads a doubled apostrophe that begins a text, or follows another one, as the text's end.
TEST(GnuplotPicture, QuotedTextKeepsItsApostrophes) {
  const TemporaryFolder folder;
  for (const std::string text : {"'a' and 'b'", "a''b", "''a'''", "it's", "a'.'b"}) {
    draw_picture("set key off\nset title " + quoted(text) + "\nplot x", size, folder / "a.svg");
    EXPECT_CONTAINS(folder.read("a.svg"), ">" + text + "<");
  }
}

TEST(GnuplotPicture, AScriptThatFailsLeavesTheOldPicture) {
  const TemporaryFolder folder;
  folder.write("a.svg", "as it was");
  EXPECT_CONTAINS(thrown_message<FigureError>([&] { draw_picture("plot nothing", size, folder / "a.svg"); }),
                  "a.svg: gnuplot could not draw it");
  EXPECT_EQ(folder.read("a.svg"), "as it was");
  EXPECT_EQ(folder.entries(), 1u);
  std::filesystem::create_directory(folder / "b.svg");
  EXPECT_CONTAINS(thrown_message<FigureError>([&] { draw_picture(line, size, folder / "b.svg"); }), "b.svg");
  EXPECT_EQ(folder.entries(), 2u);
}

// More than a pipe holds: writing to a gnuplot that is not there must end in words, not in SIGPIPE.
TEST(GnuplotPicture, MissingGnuplotIsSaid) {
  const TemporaryFolder folder;
  const std::string path = getenv("PATH");
  setenv("PATH", folder.path().c_str(), 1);
  const auto what = thrown_message<FigureError>(
      [&] { draw_picture(std::string(1'000'000, '\n') + line, size, folder / "a.svg"); });
  setenv("PATH", path.c_str(), 1);
  EXPECT_CONTAINS(what, "gnuplot is not installed");
  EXPECT_EQ(folder.entries(), 0u);
}

}  // namespace kmax::plot::gnuplot_picture_test
