// SPDX-License-Identifier: Apache-2.0
// The solids that the daemon keeps.
#include "daemon/state/solid_store.h"

#include <gtest/gtest.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>

#include <cerrno>
#include <chrono>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "config/base/sha256.h"
#include "tests/support/made_solid.h"
#include "tests/support/program.h"
#include "tests/support/sanitizer.h"
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
  EXPECT_TRUE(test::becomesTrue([&] { return watched.expired(); }));
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
  EXPECT_FALSE(store->knows(oldest));
  restart();  // ends what the worker has to do
  EXPECT_FALSE(fs::exists(fileOf(oldest)));
  EXPECT_TRUE(fs::exists(fileOf(used)));
  EXPECT_TRUE(fs::exists(fileOf(in_profile)));
}

/// A change may name the oldest while what takes its place is being stored, in any number.
TEST_F(SolidStoreTest, KeepsWhatAFixtureComesToUseWhileOthersAreStored) {
  std::vector<std::string> all;
  for (std::size_t i = 0; i < SolidStore::kMaxFiles; ++i) {
    all.push_back(stored(test::ballBytes(0.02 + 1e-5 * static_cast<double>(i), 0.004)));
    fs::last_write_time(fileOf(all.back()),
                        fs::file_time_type::clock::now() - std::chrono::hours(48 - i % 48));
  }
  auto first = store->store(test::memoryFile(test::ballBytes(0.031, 0.004)));
  auto second = store->store(test::memoryFile(test::ballBytes(0.032, 0.004)));
  ASSERT_TRUE(store->knows(all[0]));
  store->use({fixtureOf(all[0])}, 1);
  for (auto* const outcome : {&first, &second}) {
    const auto result = outcome->get();
    ASSERT_TRUE(result) << result.error().text();
    EXPECT_TRUE(store->take(*result));
  }
  waitUntilLoaded();
  EXPECT_EQ(store->problemOf({fixtureOf(all[0])}), "");
  EXPECT_TRUE(store->table().contains(all[0]));
  restart();
  EXPECT_TRUE(fs::exists(fileOf(all[0])));
  const auto files =
      std::distance(fs::directory_iterator(folder.path() / "solids"), fs::directory_iterator());
  EXPECT_EQ(static_cast<std::size_t>(files), SolidStore::kMaxFiles);
}

/// From now on the calls of this thread that map, unmap or write more at once fail.
bool refuseLargeParts(unsigned int most_bytes) {
  constexpr auto kLoad = static_cast<unsigned short>(BPF_LD | BPF_W | BPF_ABS);
  constexpr auto kSkipUnlessEqual = static_cast<unsigned short>(BPF_JMP | BPF_JEQ | BPF_K);
  constexpr auto kSkipUnlessGreater = static_cast<unsigned short>(BPF_JMP | BPF_JGT | BPF_K);
  constexpr auto kReturn = static_cast<unsigned short>(BPF_RET | BPF_K);
  constexpr auto argument = [](std::size_t i) {
    return static_cast<unsigned int>(offsetof(seccomp_data, args) + i * sizeof(std::uint64_t));
  };
  // Addresses without memory are only reserved.
  std::vector<sock_filter> filter{{kLoad, 0, 0, offsetof(seccomp_data, nr)},
                                  {kSkipUnlessEqual, 0, 4, SYS_mmap},
                                  {kLoad, 0, 0, argument(2)},
                                  {kSkipUnlessEqual, 0, 1, PROT_NONE},
                                  {kReturn, 0, 0, SECCOMP_RET_ALLOW},
                                  {kLoad, 0, 0, offsetof(seccomp_data, nr)}};
  for (const auto& [call, size] : {std::pair{SYS_mmap, 1},
                                   {SYS_munmap, 1},
                                   {SYS_mremap, 2},
                                   {SYS_write, 2},
                                   {SYS_pwrite64, 2},
                                   {SYS_sendfile, 3}}) {
    filter.push_back({kSkipUnlessEqual, 0, 4, static_cast<unsigned int>(call)});
    filter.push_back({kLoad, 0, 0, argument(static_cast<std::size_t>(size))});
    filter.push_back({kSkipUnlessGreater, 0, 1, most_bytes});
    filter.push_back({kReturn, 0, 0, SECCOMP_RET_ERRNO | ENOMEM});
    filter.push_back({kReturn, 0, 0, SECCOMP_RET_ALLOW});
  }
  filter.push_back({kReturn, 0, 0, SECCOMP_RET_ALLOW});
  const sock_fprog program{static_cast<unsigned short>(filter.size()), filter.data()};
  return ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0;
}

bool isMapped(const std::string& name) {
  std::ifstream maps("/proc/self/maps");
  return std::string(std::istreambuf_iterator(maps), {}).find(name) != std::string::npos;
}

/// No thread of the daemon waits for a large mapping, and no CPU for a large write.
TEST_F(SolidStoreTest, StoresAndLoadsALargeSolidInParts) {
  if (test::kMemoryOfSanitizer) GTEST_SKIP() << "the sanitizer maps large memory";
  const rt::DistanceGrid grid{.samples = {256, 256, 100}, .spacing_m = 1e-3, .scale_m = 1e-6};
  const std::vector<std::int16_t> outside(grid.size(), 1000);
  base::Descriptor memory = test::memoryFile(std::string(config::Solid(grid, outside, {}).file()));
  std::thread([&] {
    ASSERT_TRUE(refuseLargeParts(64 * 1024));
    const std::string sha256 = [&] {
      const auto outcome = store->store(std::move(memory)).get();  // by a thread of this one
      EXPECT_TRUE(outcome) << outcome.error().text();
      EXPECT_TRUE(isMapped("memfd:test"));
      return outcome ? outcome->solid->sha256() : "";
    }();
    EXPECT_FALSE(isMapped("memfd:test"));
    EXPECT_TRUE(config::loadSolid(folder.path() / "solids", sha256));
    EXPECT_FALSE(isMapped("memfd:hapticd-file"));
  }).join();
}

}  // namespace
}  // namespace hapticd::daemon
