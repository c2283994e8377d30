// The matrices against the series with its search for events: what a propagator accepts must be what the
// series finds.

#include "host_tools/simulation/chain_propagator.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "host_tools/simulation/chain_motion.hpp"

namespace kmax::simulation::chain_propagator_test {

class RandomChains {
 public:
  explicit RandomChains(unsigned seed) : random_(seed) {}

  double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  double over(double low, double high) { return low * std::pow(high / low, between(0.0, 1.0)); }
  double sign() { return between(-1.0, 1.0) < 0.0 ? -1.0 : 1.0; }

  template <std::size_t masses>
  ChainDynamics chain() {
    ChainDynamics chain{.masses = masses};
    for (std::size_t i = 0; i < masses; ++i) {
      chain.mass[i] = over(1e-3, 1.0);
      if (masses == 1) break;
      chain.stiffness[i] = over(10.0, 1e5);
      chain.damping[i] = between(0.0, 1.0) < 0.2 ? 0.0 : over(1e-2, 20.0);
    }
    chain.base_damping = between(0.0, 1.0) < 0.2 ? 0.0 : over(1e-3, 2.0);
    chain.friction = over(1e-3, 1.0);
    return chain;
  }

  template <std::size_t masses>
  ChainState state(bool resting) {
    ChainState state;
    const double place = between(-0.1, 0.1);
    for (std::size_t i = 0; i < masses; ++i) {
      state.position[i] = place + sign() * over(1e-7, 1e-3);
      state.velocity[i] = resting && i == 0 ? 0.0 : sign() * over(1e-6, 0.5);
    }
    return state;
  }

 private:
  std::mt19937_64 random_;
};

struct Counts {
  int tried = 0;
  int accepted = 0;
  int reversed = 0;
};

template <std::size_t masses>
void like_the_series(Counts& counts, bool resting, bool prepared = false) {
  RandomChains random((resting ? 7 : 41) + masses);
  for (int n = 0; n < 4000; ++n) {
    const ChainDynamics chain = random.chain<masses>();
    const ChainPropagator<masses> propagator(chain, random.over(1e-5, 4e-3));
    if (prepared) propagator.prepare_reversals();
    const double h = propagator.step();
    ASSERT_LE(propagator.coefficients().largest_rate() * h, 1.25 * (1.0 + 1e-12));
    for (int k = 0; k < 8; ++k) {
      MovingChain fast{.state = random.state<masses>(resting)};
      const double origin = fast.state.position[0];
      for (std::size_t i = 1; i < masses && resting; ++i) {  // a net force near the friction
        fast.state.position[i] = origin + random.between(-1.5, 1.5) * chain.friction / chain.stiffness[0];
        fast.state.velocity[i] *= random.over(1e-4, 1.0);
      }
      MovingChain slow = fast;
      slow.blocked = resting && k == 0;
      const ChainInput input =
          resting ? ChainInput{random.between(-0.5, 0.5) * chain.friction,
                               origin + random.between(-1e-3, 1e-3), random.between(-0.01, 0.01)}
                  : ChainInput{random.sign() * random.over(1e-3, 5.0), origin + random.between(-1e-2, 1e-2),
                               random.between(-0.3, 0.3)};
      ++counts.tried;
      const bool accepted =
          resting
              ? propagator.rest(fast.state, input.force, input.intended, input.intended_rate, slow.blocked)
              : propagator.slide(fast.state, input.force, input.intended, input.intended_rate);
      if (!accepted) {
        ASSERT_FALSE(slow.blocked);
        ASSERT_EQ(fast.state.position, slow.state.position);
        continue;
      }
      ++counts.accepted;
      counts.reversed += fast.state.velocity[0] * slow.state.velocity[0] < 0.0 ? 1 : 0;
      double scale = 1.0 + (resting ? 0.0 : std::abs(input.force) * h / chain.mass[0]);
      for (std::size_t i = 0; i < masses; ++i) scale += std::abs(slow.state.velocity[i]);
      ChainMotion<masses>(chain, masses).move_by_series(slow, input, h, 1.0);
      ASSERT_TRUE(slow.sticking || !resting);
      for (std::size_t i = 0; i < masses; ++i) {
        ASSERT_NEAR(fast.state.velocity[i], slow.state.velocity[i], 1e-12 * scale) << n << " mass " << i;
        ASSERT_NEAR(fast.state.position[i], slow.state.position[i], 1e-14 * scale) << n << " mass " << i;
      }
    }
  }
}

TEST(ChainPropagator, SlidesLikeTheSeries) {
  Counts one, two, three;
  like_the_series<1>(one, false);
  like_the_series<2>(two, false);
  like_the_series<3>(three, false, true);
  for (const Counts& counts : {one, two, three}) {
    EXPECT_GT(counts.accepted, counts.tried / 3) << counts.tried;
    EXPECT_LT(counts.accepted, counts.tried);
    EXPECT_GT(counts.reversed, counts.tried / 100);
  }
}

TEST(ChainPropagator, RestsLikeTheSeries) {
  Counts two, three;
  like_the_series<2>(two, true);
  like_the_series<3>(three, true);
  for (const Counts& counts : {two, three}) {
    EXPECT_GT(counts.accepted, counts.tried / 5) << counts.tried;
    EXPECT_LT(counts.accepted, counts.tried);
  }
}

TEST(ChainPropagator, DividesAnIntervalThatIsLongForTheChain) {
  ChainDynamics chain{.masses = 2, .mass = {1e-3, 0.2}, .stiffness = {1e6, 100.0}};
  const ChainPropagator<2> propagator(chain, 0.002);
  EXPECT_GT(propagator.steps(), 40);
  EXPECT_NEAR(propagator.step() * propagator.steps(), 0.002, 1e-18);
}

// What is not a number or overflows is never proven: the series, and its caller's checks, decide.
TEST(ChainPropagator, AcceptsNothingThatIsNotFinite) {
  ChainDynamics chain{.masses = 2, .mass = {0.045, 0.2}, .stiffness = {500.0, 100.0}, .friction = 0.1};
  const ChainPropagator<2> propagator(chain, 0.002);
  for (const double bad : {std::nan(""), 1e300, -1e300}) {
    ChainState state;
    state.velocity[0] = 0.1;
    EXPECT_FALSE(propagator.slide(state, bad, 0.0, 0.0));
    state.velocity[0] = 0.0;
    EXPECT_FALSE(propagator.rest(state, bad, 0.0, 0.0, false));
  }
}

}  // namespace kmax::simulation::chain_propagator_test
