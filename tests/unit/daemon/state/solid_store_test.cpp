// SPDX-License-Identifier: Apache-2.0
// The solids that the daemon keeps.
#include "daemon/state/solid_store.h"

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "config/base/sha256.h"
#include "tests/support/made_solid.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::daemon {
namespace {

namespace fs = std::filesystem;

config::FixtureSettings fixtureOf(const std::string& sha256) {
  return {.name = "organ", .kind = rt::FixtureKind::solid, .solid = sha256};
}

class SolidStoreTest : public testing::Test {
 protected:
  /// Stores a solid and takes it; returns its SHA-256.
  std::string stored(const std::string& bytes) {
    auto outcome = store->store(test::memoryFile(bytes)).get();
    EXPECT_TRUE(outcome) << outcome.error().text();
    if (!outcome) return {};
    const auto taken = store->take(*outcome);
    EXPECT_TRUE(taken) << taken.error().text();
    return outcome->solid->sha256();
  }
  void waitUntilLoaded() {
    for (int i = 0; i < 6000 && store->loading(); ++i) {
      store->takeLoaded();
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    EXPECT_FALSE(store->loading());
  }
  void restart() { store = std::make_unique<SolidStore>(folder.path()); }
  fs::path fileOf(const std::string& sha256) const {
    return folder.path() / "solids" / config::solidFileName(sha256);
  }

  const test::TemporaryFolder folder;
  std::unique_ptr<SolidStore> store = std::make_unique<SolidStore>(folder.path());
};

TEST_F(SolidStoreTest, KeepsASolidUnderItsHashAcrossAStart) {
  const std::string bytes = test::ballBytes(0.02);
  EXPECT_FALSE(store->knows(base::sha256(bytes)));
  const std::string sha256 = stored(bytes);
  EXPECT_EQ(sha256, base::sha256(bytes));
  EXPECT_TRUE(store->knows(sha256));
  EXPECT_TRUE(store->table().contains(sha256));
  EXPECT_EQ(fs::file_size(fileOf(sha256)), bytes.size());
  EXPECT_EQ(stored(bytes), sha256);  // the same content, once

  restart();
  EXPECT_TRUE(store->knows(sha256));
  EXPECT_TRUE(store->table().empty());
  store->load({fixtureOf(sha256)});
  EXPECT_TRUE(store->table().contains(sha256));
  EXPECT_EQ(store->problemOf({fixtureOf(sha256)}), "");
}

TEST_F(SolidStoreTest, ReadsWhatAFixtureNamesWithoutWaiting) {
  const std::string sha256 = stored(test::ballBytes(0.02));
  restart();
  store->use({fixtureOf(sha256)}, 1);
  waitUntilLoaded();
  EXPECT_TRUE(store->table().contains(sha256));
}

TEST_F(SolidStoreTest, RefusesMemoryThatSomebodyCanChange) {
  const std::string bytes = test::ballBytes(0.02);
  for (const int seals : {0, F_SEAL_WRITE, F_SEAL_WRITE | F_SEAL_SHRINK, F_SEAL_SHRINK | F_SEAL_GROW}) {
    const auto outcome = store->store(test::memoryFile(bytes, seals)).get();
    ASSERT_FALSE(outcome);
    EXPECT_NE(outcome.error().what.find("sealed"), std::string::npos);
  }
  folder.write("plain", bytes);
  base::Descriptor plain(::open((folder.path() / "plain").c_str(), O_RDONLY | O_CLOEXEC));
  EXPECT_FALSE(store->store(std::move(plain)).get());
  EXPECT_FALSE(store->store(base::Descriptor()).get());
  EXPECT_FALSE(store->store(test::memoryFile("")).get());
  EXPECT_FALSE(store->store(test::memoryFile("no solid")).get());
  EXPECT_TRUE(store->table().empty());
  EXPECT_FALSE(fs::exists(folder.path() / "solids"));
}

TEST_F(SolidStoreTest, SaysWhyAFixtureDoesNotAct) {
  const std::string sha256 = stored(test::ballBytes(0.02));
  fs::resize_file(fileOf(sha256), 1000);
  restart();
  store->load({fixtureOf(sha256)});
  const std::string problem = store->problemOf({fixtureOf(sha256)});
  EXPECT_NE(problem.find("fixture organ does not act"), std::string::npos) << problem;
  EXPECT_FALSE(store->table().contains(sha256));
  config::FixtureSettings disabled = fixtureOf(sha256);
  disabled.enabled = false;
  EXPECT_EQ(store->problemOf({disabled}), "");
  // It is sent again.
  EXPECT_EQ(stored(test::ballBytes(0.02)), sha256);
  EXPECT_EQ(store->problemOf({fixtureOf(sha256)}), "");
  EXPECT_EQ(fs::file_size(fileOf(sha256)), test::ballBytes(0.02).size());
  // The fixture acts as soon as its set is handed over again.
  EXPECT_TRUE(store->loading());
  EXPECT_TRUE(store->takeLoaded());
  EXPECT_FALSE(store->loading());
  EXPECT_FALSE(store->takeLoaded());
}

/// The force loop reads the one that it has.
TEST_F(SolidStoreTest, KeepsASolidInUseWhenTheSameComesAgain) {
  const std::string bytes = test::ballBytes(0.02);
  const std::string sha256 = stored(bytes);
  const std::weak_ptr<const config::Solid> offered = store->table().at(sha256);
  stored(bytes);
  EXPECT_FALSE(offered.expired());
  store->use({fixtureOf(sha256)}, 1);
  stored(bytes);
  EXPECT_FALSE(offered.expired());
  EXPECT_FALSE(store->takeLoaded());

  // It comes while the file is being read.
  restart();
  store->use({fixtureOf(sha256)}, 1);
  stored(bytes);
  const std::weak_ptr<const config::Solid> sent = store->table().at(sha256);
  waitUntilLoaded();
  EXPECT_FALSE(sent.expired());
}

TEST_F(SolidStoreTest, LimitsTheMemoryOfAllSolids) {
  const std::string first = test::ballBytes(0.02);
  const std::string second = test::ballBytes(0.021);
  const std::string third = test::ballBytes(0.022);
  store = std::make_unique<SolidStore>(folder.path(), first.size() + third.size());
  // An offer makes room for the next.
  const std::string used = stored(first);
  store->use({fixtureOf(used)}, 1);
  const std::string forgotten = stored(second);
  const std::string in_use_too = stored(third);
  EXPECT_FALSE(store->table().contains(forgotten));
  store->use({fixtureOf(used), fixtureOf(in_use_too)}, 2);
  // What fixtures use does not.
  const auto outcome = store->store(test::memoryFile(second)).get();
  ASSERT_TRUE(outcome) << outcome.error().text();
  const auto taken = store->take(*outcome);
  ASSERT_FALSE(taken);
  EXPECT_NE(taken.error().what.find("all solids together"), std::string::npos) << taken.error().text();
  store->use({fixtureOf(used), fixtureOf(in_use_too), fixtureOf(forgotten)}, 3);
  waitUntilLoaded();
  EXPECT_EQ(store->table().size(), 2U);
  EXPECT_NE(store->problemOf({fixtureOf(forgotten)}), "");
}

/// The force loop may read a solid until it has a set without it.
TEST_F(SolidStoreTest, ReleasesASolidWhenTheLoopHasANewerSet) {
  const std::string sha256 = stored(test::ballBytes(0.02));
  store->use({fixtureOf(sha256)}, 5);
  const std::weak_ptr<const config::Solid> watched = store->table().at(sha256);
  store->release(5);
  EXPECT_FALSE(watched.expired());
  store->use({}, 6);
  EXPECT_TRUE(store->table().empty());
  store->release(5);
  EXPECT_FALSE(watched.expired());
  store->release(6);
  EXPECT_TRUE(watched.expired());
}

TEST_F(SolidStoreTest, ForgetsOffersThatNobodyUses) {
  std::vector<std::string> all;
  for (int i = 0; i < 6; ++i) all.push_back(stored(test::ballBytes(0.02 + 0.001 * i)));
  EXPECT_EQ(store->table().size(), 4U);
  EXPECT_TRUE(store->table().contains(all.back()));
  EXPECT_TRUE(store->knows(all.front()));  // on the disk
}

TEST_F(SolidStoreTest, MakesRoomForANewFileByTheOldestThatNobodyUses) {
  const std::string used = stored(test::ballBytes(0.0201, 0.004));
  const std::string in_profile = stored(test::ballBytes(0.0202, 0.004));
  const std::string oldest = stored(test::ballBytes(0.0203, 0.004));
  const auto old = fs::file_time_type::clock::now() - std::chrono::hours(48);
  for (const std::string& sha256 : {used, in_profile, oldest}) fs::last_write_time(fileOf(sha256), old);
  store->use({fixtureOf(used)}, 1);
  fs::create_directories(folder.path() / "profiles");
  folder.write("profiles/a.yaml", "fixtures:\n  - solid: \"" + in_profile + "\"\n");
  std::size_t count = 3;
  for (; count < SolidStore::kMaxFiles; ++count)
    stored(test::ballBytes(0.021 + 1e-5 * static_cast<double>(count), 0.004));
  EXPECT_TRUE(fs::exists(fileOf(oldest)));
  // Offers are in use too; these are older than they.
  stored(test::ballBytes(0.03, 0.004));
  EXPECT_FALSE(fs::exists(fileOf(oldest)));
  EXPECT_FALSE(store->knows(oldest));
  EXPECT_TRUE(fs::exists(fileOf(used)));
  EXPECT_TRUE(fs::exists(fileOf(in_profile)));
}

}  // namespace
}  // namespace hapticd::daemon
