// SPDX-License-Identifier: Apache-2.0
// Reading the settings again without waiting for the disk.
#include "daemon/state/start_settings.h"

#include <gtest/gtest.h>

#include <memory>

namespace hapticd::daemon {
namespace {

using Outcome = SettingsReader::Outcome;

constexpr std::chrono::seconds kGenerous{60};

/// A disk that responds when the test lets it.
struct Disk {
  std::promise<void> answer;
  std::shared_future<void> answered = answer.get_future().share();

  std::function<Outcome()> read() const {
    return [answered = answered]() -> Outcome {
      answered.wait();
      return StartSettings{};
    };
  }
};

/// Polls at the time `now` until there is an outcome.
std::optional<Outcome> awaited(SettingsReader& reader, SettingsReader::Clock::time_point now) {
  const auto deadline = std::chrono::steady_clock::now() + kGenerous;
  while (std::chrono::steady_clock::now() < deadline) {
    if (auto outcome = reader.outcome(now)) return outcome;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return std::nullopt;
}

const SettingsReader::Clock::time_point kBegin{std::chrono::hours(1)};

TEST(SettingsReader, HasNoOutcomeUntilTheDiskAnswersAndOneThen) {
  Disk disk;
  SettingsReader reader(disk.read(), "hapticd.yaml");
  EXPECT_FALSE(reader.outcome(kBegin));
  reader.begin(kBegin);
  EXPECT_TRUE(reader.reading());
  EXPECT_FALSE(reader.outcome(kBegin));
  disk.answer.set_value();
  const auto outcome = awaited(reader, kBegin);
  ASSERT_TRUE(outcome);
  EXPECT_TRUE(*outcome);
  EXPECT_FALSE(reader.reading());
  EXPECT_FALSE(reader.outcome(kBegin));
}

TEST(SettingsReader, GivesUpADiskThatDoesNotAnswerAndReadsAgainWhenItDoes) {
  Disk disk;
  SettingsReader reader(disk.read(), "hapticd.yaml");
  reader.begin(kBegin);
  EXPECT_FALSE(reader.outcome(kBegin + SettingsReader::kPatience - std::chrono::milliseconds(1)));
  const auto given_up = reader.outcome(kBegin + SettingsReader::kPatience);
  ASSERT_TRUE(given_up);
  ASSERT_FALSE(*given_up);
  EXPECT_EQ(
      given_up->error().front().text(),
      "hapticd.yaml: has not been read after 10 s: the disk does not answer (check the disk or the network "
      "file system, and reload again)");
  disk.answer.set_value();
  reader.begin(kBegin + std::chrono::minutes(1));
  const auto outcome = awaited(reader, kBegin + std::chrono::minutes(1));
  ASSERT_TRUE(outcome);
  EXPECT_TRUE(*outcome);
}

// If the end waited for the disk it would never come: the disk answers only after it.
TEST(SettingsReader, EndsThoughTheDiskDoesNotAnswer) {
  Disk disk;
  {
    SettingsReader reader(disk.read(), "hapticd.yaml");
    reader.begin(kBegin);
  }
  disk.answer.set_value();
}

}  // namespace
}  // namespace hapticd::daemon
