// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "config/settings/parameter_table.h"
#include "daemon/reloader.h"
#include "daemon/running_box.h"
#include "tests/support/golden_file.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

// Changes of the configuration that a running daemon applies when it is read again.
namespace hapticd::daemon {
namespace {

config::Settings with(const std::vector<std::string>& assignments) {
  config::Settings settings;
  for (const std::string& assignment : assignments) {
    EXPECT_TRUE(config::setFromText(settings, assignment)) << assignment;
  }
  return settings;
}

std::string valueOf(const config::Settings& settings, std::string_view name) {
  return config::toText(config::findParameter(name)->get(settings));
}

using Names = std::vector<std::string_view>;

/// The parameters whose values differ.
Names changed(const config::Settings& before, const config::Settings& after) {
  Names names;
  for (const config::Parameter& parameter : config::allParameters()) {
    if (parameter.get(before) != parameter.get(after)) names.push_back(parameter.name);
  }
  return names;
}

TEST(Reload, TakesLiveParameters) {
  const auto reload = reloaded(with({}), with({"force.stiffness_n_per_m=321"}));
  ASSERT_TRUE(reload);
  EXPECT_EQ(changed(with({}), reload->settings), Names{"force.stiffness_n_per_m"});
  EXPECT_EQ(valueOf(reload->settings, "force.stiffness_n_per_m"), "321");
}

TEST(Reload, TakesBackWhatAClientHasSet) {
  const auto reload = reloaded(with({"safety.max_force_n=2"}), with({}));
  ASSERT_TRUE(reload);
  EXPECT_EQ(valueOf(reload->settings, "safety.max_force_n"), "4");
}

TEST(Reload, LeavesParametersThatNeedARestartAndNamesThem) {
  const auto reload = reloaded(with({}), with({"loop.priority=70", "camera.driver=synthetic"}));
  ASSERT_TRUE(reload);
  EXPECT_EQ(reload->waiting, (std::vector<std::string_view>{"camera.driver", "loop.priority"}));
  EXPECT_EQ(valueOf(reload->settings, "loop.priority"), "80");
  EXPECT_EQ(valueOf(reload->settings, "camera.driver"), "freenect");
}

TEST(Reload, IsRefusedWhenTheNewLiveParametersContradictWhatCannotChangeNow) {
  // A radius that the depth unit of the file holds, but not the finer one of the running daemon.
  const config::Settings loaded =
      with({"camera.driver=v4l2", "force.law=nearest_springs", "force.radius_m=0.06"});
  ASSERT_TRUE(config::checkTogether(loaded).empty());
  const auto reload = reloaded(
      with({"camera.driver=v4l2", "camera.unit_um=70", "force.law=nearest_springs", "force.radius_m=0.03"}),
      loaded);
  ASSERT_FALSE(reload);
  EXPECT_NE(reload.error().front().text().find("force.radius_m"), std::string::npos)
      << reload.error().front().text();
}

TEST(Reload, KnowsEveryParameterOfTheTable) {
  config::Settings loaded;
  std::size_t different = 0;
  for (const config::Parameter& parameter : config::allParameters()) {
    if (parameter.kind != config::Kind::boolean) continue;
    parameter.set(loaded, !std::get<bool>(parameter.get(loaded)));
    ++different;
  }
  const auto reload = reloaded(config::Settings{}, loaded);
  ASSERT_TRUE(reload);
  EXPECT_EQ(changed(config::Settings{}, reload->settings).size() + reload->waiting.size(), different);
  EXPECT_GT(different, 0U);
}

// --- Fixtures and regions

using config::Origin;

config::FixtureSettings fixture(const std::string& name, Origin origin, double radius_m = 0.01) {
  config::FixtureSettings fixture{.name = name};
  fixture.radius_m = radius_m;
  fixture.origin.value = origin;
  return fixture;
}

config::RegionSettings region(const std::string& name, Origin origin) {
  config::RegionSettings region{.name = name};
  region.radius_m = 0.01;
  region.origin.value = origin;
  return region;
}

config::Settings with(const std::vector<config::FixtureSettings>& fixtures) {
  config::Settings settings;
  settings.additions.fixtures = fixtures;
  return settings;
}

/// "name origin radius" of each.
std::vector<std::string> shown(const std::vector<config::FixtureSettings>& fixtures) {
  std::vector<std::string> texts;
  for (const config::FixtureSettings& fixture : fixtures) {
    texts.push_back(fixture.name + " " + std::string(rt::wordOf(fixture.origin.value)) + " " +
                    config::toText(fixture.radius_m));
  }
  return texts;
}

using Texts = std::vector<std::string>;
constexpr Origin kFile = Origin::configuration, kClient = Origin::client, kProfile = Origin::profile;

/// The fixtures of a list such as "a client 0.01, b profile 0.02".
std::vector<config::FixtureSettings> fixturesIn(const std::string& list) {
  std::vector<config::FixtureSettings> fixtures;
  std::istringstream items(list);
  for (std::string item; std::getline(items, item, ',');) {
    std::istringstream words(item);
    std::string name, origin;
    double radius_m = 0;
    words >> name >> origin >> radius_m;
    fixtures.push_back(fixture(name,
                               origin == "client"    ? kClient
                               : origin == "profile" ? kProfile
                                                     : kFile,
                               radius_m));
  }
  return fixtures;
}

/// `fixtures RUNNING | FILE`; `regions RUNNING | FILE` by their names, of which those behind m are of
/// clients.
std::string reloadOf(const std::string& command) {
  const std::size_t bar = command.find('|'), begin = command.find(' ');
  const std::string running = command.substr(begin + 1, bar - begin - 1), file = command.substr(bar + 1);
  config::Settings before, loaded;
  if (command.starts_with("fixtures")) {
    before = with(fixturesIn(running));
    loaded = with(fixturesIn(file));
  } else {
    for (const char name : running)
      if (name != ' ')
        before.additions.regions.push_back(region(std::string(1, name), name < 'n' ? kFile : kClient));
    for (const char name : file)
      if (name != ' ') loaded.additions.regions.push_back(region(std::string(1, name), kFile));
  }
  const auto reload = reloaded(before, loaded);
  EXPECT_TRUE(reload) << command;
  std::string lines;
  for (const std::string& text : shown(reload->settings.additions.fixtures)) lines += text + "\n";
  for (const config::RegionSettings& region : reload->settings.additions.regions) lines += region.name + " ";
  for (const std::string& hidden : reload->hidden) lines += "hidden: " + hidden + "\n";
  return lines;
}

TEST(Reload, OfFixturesAndRegionsIsAsWritten) {
  hapticd::test::expectTranscript(HAPTICD_SOURCE_FOLDER "/tests/unit/daemon/reloads.golden", reloadOf);
}

TEST(Reload, ChangesNothingTheSecondTimeOnRandomLists) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 2000; ++trial) {
    const auto randomList = [&random](bool of_file) {
      std::vector<config::FixtureSettings> list;
      for (const std::string name : {"a", "b", "c", "d", "e"}) {
        if (random() % 2 == 0) continue;
        const Origin origin = of_file ? kFile : static_cast<Origin>(random() % 3);
        list.push_back(fixture(name, origin, 0.01 * static_cast<double>(1 + random() % 3)));
      }
      std::ranges::shuffle(list, random);
      return list;
    };
    const config::Settings running = with(randomList(false));
    const config::Settings file = with(randomList(true));
    const auto first = reloaded(running, file);
    ASSERT_TRUE(first);
    const auto second = reloaded(first->settings, file);
    ASSERT_TRUE(second);
    EXPECT_EQ(shown(second->settings.additions.fixtures), shown(first->settings.additions.fixtures));
    EXPECT_EQ(second->hidden, first->hidden);
    // Each is there exactly where its definition asks for it.
    for (const std::string name : {"a", "b", "c", "d", "e"}) {
      const auto in = [&name](const config::Settings& settings) {
        const auto& list = settings.additions.fixtures;
        const auto found = std::ranges::find(list, name, &config::FixtureSettings::name);
        return found == list.end() ? nullptr : &*found;
      };
      const auto* const before = in(running);
      const auto* const wanted = in(file);
      const bool others = before != nullptr && before->origin.value != kFile;
      const auto* const expected = others ? before : wanted;
      const auto* const after = in(first->settings);
      ASSERT_EQ(after != nullptr, expected != nullptr) << name;
      if (after == nullptr) continue;
      EXPECT_EQ(shown({*after}), shown({*expected}));
    }
    if (HasFailure()) return;
  }
}

TEST(Reload, IsRefusedWhereThereWouldBeTooManyFixtures) {
  std::vector<config::FixtureSettings> running;
  for (int i = 0; i < 16; ++i) running.push_back(fixture("c" + std::to_string(i), kClient));
  const auto reload = reloaded(with(running), with({fixture("a", kFile)}));
  ASSERT_FALSE(reload);
  EXPECT_NE(reload.error().front().text().find("is one of 17 fixtures, and 16 are possible"),
            std::string::npos);
}

TEST(Reload, LeavesTheLabelImageOfAProfile) {
  config::Settings running;
  running.additions.label_image = "profile.pgm";
  running.additions.label_image_origin.value = kProfile;
  config::Settings file;
  EXPECT_EQ(reloaded(running, file)->settings.additions.label_image, "profile.pgm");
  file.additions.label_image = "file.pgm";
  EXPECT_EQ(reloaded(running, file)->hidden, Texts{"label_image"});
  running.additions.label_image_origin.value = kFile;
  EXPECT_EQ(reloaded(running, file)->settings.additions.label_image, "file.pgm");
}

// What a reload loosens while the box is engaged waits for a person; everything else does not.

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
  EXPECT_EQ(box_.settings().live.force.radius_m, 0.03);
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
  settings.live.force.min_points = 50;
  settings.live.force.max_points = 60;
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
  EXPECT_EQ(box_.settings().live.force.min_points, 50);
  EXPECT_EQ(fixtures().size(), 16U);
  EXPECT_EQ(held().size(), 17U) << "all sixteen, and that the rest waits too";
  ASSERT_TRUE(reloader_.confirm());
  EXPECT_EQ(fixtures(), Texts{"nerve"});
  EXPECT_EQ(box_.settings().live.force.min_points, 20);
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
