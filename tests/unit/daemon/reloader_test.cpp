// SPDX-License-Identifier: Apache-2.0
// What a reload loosens while the box is engaged waits for a person; everything else does not.
#include "daemon/reloader.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "daemon/running_box.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::daemon {
namespace {

using Texts = std::vector<std::string>;

constexpr const char* kNerve =
    "fixtures: [{name: nerve, kind: sphere, position_m: [0, 0, -1], radius_m: 0.01}]\n";

class ReloaderTest : public testing::Test {
 protected:
  ReloaderTest() {
    config::Settings settings = box_.settings();
    settings.additions = start("safety: {max_force_n: 1}\n" + std::string(kNerve)).settings.additions;
    settings.live.safety.max_force_n = 1;
    box_.apply(settings);
  }

  StartSettings start(const std::string& yaml) const {
    const auto started = startSettings(folder_.write("hapticd.yaml", yaml), overrides());
    EXPECT_TRUE(started);
    return started.value_or(StartSettings{});
  }
  std::vector<std::string> overrides() const { return {"state.folder=" + folder_.path().string()}; }

  /// Reads the file again and waits for the outcome.
  Reloads::Outcome reload(const std::string& yaml) {
    folder_.write("hapticd.yaml", yaml);
    const std::uint64_t number = reloader_.request();
    std::optional<Reloads::Outcome> outcome;
    EXPECT_TRUE(hapticd::test::becomesTrue([&] {
      poll();
      return (outcome = reloader_.outcome(number)).has_value();
    }));
    return outcome.value_or(Reloads::Outcome());
  }
  void poll() {
    reloader_.periodic(
        Reloader::Clock::now(), [] {}, [] {});
  }
  Texts held() const {
    Texts texts;
    if (!reloader_.pending()) return texts;
    for (const config::Loosening& loosening : reloader_.pending()->loosenings)
      texts.push_back(loosening.text);
    return texts;
  }
  double maxForce_n() const { return box_.settings().live.safety.max_force_n; }
  Texts fixtures() const {
    Texts names;
    for (const config::FixtureSettings& fixture : box_.settings().additions.fixtures)
      names.push_back(fixture.name);
    return names;
  }
  bool hasLogged(const std::string& text) const {
    return std::ranges::any_of(log_,
                               [&](const std::string& line) { return line.find(text) != std::string::npos; });
  }
  void addByClient(const std::string& name) {
    config::Settings settings = box_.settings();
    config::FixtureSettings fixture{.name = name};
    fixture.radius_m = 0.01;
    fixture.origin.value = config::Origin::client;
    settings.additions.fixtures.push_back(fixture);
    box_.apply(settings);
  }

  const hapticd::test::TemporaryFolder folder_;
  RunningBox box_{[this] {
    config::Settings settings;
    settings.state.folder = folder_.path();
    return settings;
  }()};  // no force loop is needed to change its settings
  Texts log_;
  Reloader reloader_{box_,
                     start("force:\n"),
                     {folder_.path() / "hapticd.yaml", overrides()},
                     [this](const JournalEntry& entry) { log_.push_back(entry.text); }};
};

TEST_F(ReloaderTest, AppliesEverythingWhileTheBoxIsNotEngagedAndSaysWhatItLoosens) {
  const auto outcome = reload("force: {radius_m: 0.03}\n");
  ASSERT_TRUE(outcome);
  EXPECT_EQ(maxForce_n(), 4);
  EXPECT_EQ(fixtures(), Texts{});
  EXPECT_FALSE(reloader_.pending());
  EXPECT_TRUE(hasLogged("reload has loosened: safety.max_force_n from 1 to 4 N; fixture nerve is removed"));
  EXPECT_EQ(outcome->changes.size(), 3U);
}

TEST_F(ReloaderTest, HoldsBackByNameWhatLoosensWhileTheBoxIsEngagedAndAppliesTheRest) {
  box_.engage(true, false);
  const auto outcome = reload("force: {radius_m: 0.03}\nsafety: {max_slew_n_per_s: 100}\n");
  ASSERT_TRUE(outcome);
  EXPECT_EQ(maxForce_n(), 1);
  EXPECT_EQ(fixtures(), Texts{"nerve"});
  EXPECT_EQ(box_.settings().live.springs.radius_m, 0.03);
  EXPECT_EQ(box_.settings().live.safety.max_slew_n_per_s, 100) << "tighter";
  EXPECT_EQ(held(), (Texts{"safety.max_force_n from 1 to 4 N", "fixture nerve is removed"}));
  EXPECT_TRUE(
      hasLogged("reload does not loosen while the box is engaged: safety.max_force_n from 1 to 4 N; "
                "fixture nerve is removed"));
  ASSERT_EQ(reloader_.warnings().size(), 1U);
  EXPECT_NE(reloader_.warnings()[0].find("fixture nerve is removed"), std::string::npos);
}

TEST_F(ReloaderTest, AppliesWhatItHeldBackWhenThatIsConfirmed) {
  box_.engage(true, false);
  ASSERT_TRUE(reload("force:\n"));
  const auto confirmed = reloader_.confirm();
  ASSERT_TRUE(confirmed);
  EXPECT_EQ(confirmed->changes.size(), 2U);
  EXPECT_EQ(maxForce_n(), 4);
  EXPECT_EQ(fixtures(), Texts{});
  EXPECT_FALSE(reloader_.pending());
  EXPECT_TRUE(reloader_.warnings().empty());
}

TEST_F(ReloaderTest, AppliesWhatItHeldBackWhenTheBoxIsDisengaged) {
  box_.engage(true, false);
  ASSERT_TRUE(reload("force:\n"));
  poll();
  EXPECT_EQ(maxForce_n(), 1);
  box_.engage(false, false);
  poll();
  EXPECT_EQ(maxForce_n(), 4);
  EXPECT_EQ(fixtures(), Texts{});
  EXPECT_FALSE(reloader_.pending());
}

TEST_F(ReloaderTest, NeverTouchesWhatClientsAdded) {
  addByClient("vessel");
  box_.engage(true, false);
  ASSERT_TRUE(reload("force:\n"));
  EXPECT_EQ(fixtures(), (Texts{"nerve", "vessel"}));
  EXPECT_EQ(held(), (Texts{"safety.max_force_n from 1 to 4 N", "fixture nerve is removed"}));
  ASSERT_TRUE(reloader_.confirm());
  EXPECT_EQ(fixtures(), Texts{"vessel"});
}

TEST_F(ReloaderTest, FollowsWhatClientsChangeWhileSomethingWaits) {
  box_.engage(true, false);
  ASSERT_TRUE(reload("safety: {max_force_n: 2}\n" + std::string(kNerve)));
  EXPECT_EQ(held(), Texts{"safety.max_force_n from 1 to 2 N"});
  config::Settings settings = box_.settings();
  settings.live.safety.max_force_n = 1.5;
  box_.apply(settings);
  poll();
  EXPECT_EQ(held(), Texts{"safety.max_force_n from 1.5 to 2 N"});
  settings.live.safety.max_force_n = 3;  // a client may, and says so by name
  box_.apply(settings);
  poll();
  EXPECT_FALSE(reloader_.pending());
  EXPECT_EQ(maxForce_n(), 3);
}

TEST_F(ReloaderTest, ForgetsWhatWaitsWhenTheFileNoLongerLoosensAndKeepsItWhenTheFileIsBad) {
  box_.engage(true, false);
  ASSERT_TRUE(reload("force:\n"));
  ASSERT_FALSE(reload(""));
  EXPECT_EQ(held().size(), 2U);
  ASSERT_TRUE(reload("safety: {max_force_n: 1}\n" + std::string(kNerve)));
  EXPECT_FALSE(reloader_.pending());
  box_.engage(false, false);
  poll();
  EXPECT_EQ(maxForce_n(), 1);
}

TEST_F(ReloaderTest, HoldsBackAllOfAReloadThatMakesNoSenseWithoutWhatLoosens) {
  config::Settings settings = box_.settings();
  settings.live.springs.min_points = 50;
  settings.live.springs.max_points = 60;
  settings.additions.fixtures.clear();
  for (int i = 0; i < 16; ++i) {
    config::FixtureSettings fixture{.name = "f" + std::to_string(i)};
    fixture.radius_m = 0.01;
    settings.additions.fixtures.push_back(fixture);
  }
  box_.apply(settings);
  box_.engage(true, false);
  // The old ones stay, and there is no room for a new one beside them.
  ASSERT_TRUE(reload("force: {min_points: 20}\nsafety: {max_force_n: 1}\n" + std::string(kNerve)));
  EXPECT_EQ(box_.settings().live.springs.min_points, 50);
  EXPECT_EQ(fixtures().size(), 16U);
  EXPECT_EQ(held().size(), 17U) << "all sixteen, and that the rest waits too";
  ASSERT_TRUE(reloader_.confirm());
  EXPECT_EQ(fixtures(), Texts{"nerve"});
  EXPECT_EQ(box_.settings().live.springs.min_points, 20);
}

TEST_F(ReloaderTest, RefusesABadFileAndNamesEachProblem) {
  const auto outcome = reload("force: {radius_m: 99}\nsafety: {max_force_n: x}\n");
  ASSERT_FALSE(outcome);
  EXPECT_EQ(outcome.error().size(), 2U);
  EXPECT_EQ(maxForce_n(), 1);
  EXPECT_TRUE(hasLogged("reload refused: "));
}

}  // namespace
}  // namespace hapticd::daemon
