// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "drivers/handle/hid/hid_controller.h"
#include "drivers/handle/hid/hid_settings.h"
#include "drivers/handle/hid/hid_spacemouse.h"

namespace hapticd::drivers {
namespace {

constexpr double kHalfPositionUnitM = 0.5e-7;
constexpr double kHalfForceUnitN = 0.5e-4;

std::vector<std::uint8_t> bytesOf(const std::string& hex) {
  std::istringstream words(hex);
  std::vector<std::uint8_t> bytes;
  for (std::string word; words >> word;) {
    bytes.push_back(static_cast<std::uint8_t>(std::stoul(word, nullptr, 16)));
  }
  return bytes;
}

// The two examples of reports.md; their checksums were computed with Python's zlib.crc32.
const std::vector<std::uint8_t> kInputExample = bytesOf(
    "48 69 01 01 01 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 "
    "00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 FC CB BD 9F");
const std::vector<std::uint8_t> kOutputExample = bytesOf(
    "48 6F 01 01 02 00 00 00 10 27 00 00 78 EC FF FF 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 "
    "00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 ED 91 AA F1");

/// Recomputes the checksum after a change.
Report resealed(Report report) {
  const std::uint32_t crc = crc32(ReportBytes(report).first(60));
  for (std::size_t byte = 0; byte < 4; ++byte)
    report[60 + byte] = static_cast<std::uint8_t>(crc >> (8 * byte));
  return report;
}

InputReport someInput() {
  InputReport input;
  input.homing = true;
  input.sequence = 0xFFFFFFFE;
  input.time_us = 123456789;
  input.position_m = {0.1234567, -0.05, 2};
  input.velocity_m_per_s = rt::Vec3{-20, 0.25, 0};
  input.buttons = 0x80000001;
  input.echo = 77;
  input.echo_age_us = 850;
  input.fault_code = 0xBEEF;
  return input;
}

TEST(HidReport, MatchesTheExamplesOfTheDocumentByteForByte) {
  InputReport input;
  input.sequence = 1;
  EXPECT_TRUE(std::ranges::equal(encode(input), kInputExample));
  EXPECT_TRUE(std::ranges::equal(encode(OutputReport{true, 2, {1, -0.5, 0}}), kOutputExample));
  const auto output = outputFrom(kOutputExample);
  ASSERT_TRUE(output);
  EXPECT_TRUE(output->exert);
  EXPECT_EQ(output->sequence, 2U);
  EXPECT_EQ(output->force_n, (rt::Vec3{1, -0.5, 0}));
}

TEST(HidReport, CarriesAllOfAMeasurement) {
  const InputReport sent = someInput();
  const auto got = inputFrom(encode(sent));
  ASSERT_TRUE(got) << textOf(got.error());
  EXPECT_TRUE(got->calibrated && got->homing && !got->watchdog_acted);
  EXPECT_EQ(got->sequence, sent.sequence);
  EXPECT_EQ(got->time_us, sent.time_us);
  EXPECT_LE(norm(got->position_m - sent.position_m), 2 * kHalfPositionUnitM);
  EXPECT_LE(norm(got->velocity_m_per_s.value() - *sent.velocity_m_per_s), 1e-6);
  EXPECT_EQ(got->buttons, sent.buttons);
  EXPECT_EQ(got->echo, 77U);
  EXPECT_EQ(got->echo_age_us, 850U);
  EXPECT_EQ(got->fault_code, 0xBEEF);
}

TEST(HidReport, ShortensAForceBeyondTheRangeAndKeepsItsDirection) {
  const auto strong = outputFrom(encode(OutputReport{true, 1, {300, -150, 30}}));
  ASSERT_TRUE(strong);
  EXPECT_LE(norm(strong->force_n - rt::Vec3{100, -50, 10}), 2 * kHalfForceUnitN);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto broken = outputFrom(encode(OutputReport{true, 1, {1, nan, 1}}));
  ASSERT_TRUE(broken);
  EXPECT_EQ(broken->force_n, rt::Vec3{});
}

TEST(HidReport, IsRefusedWithTheReason) {
  const Report good = encode(someInput());
  const auto refusal = [](ReportBytes bytes) { return inputFrom(bytes).error(); };
  const auto with = [&](std::size_t place, std::uint8_t value) {
    Report report = good;
    report[place] = value;
    return report;
  };
  EXPECT_EQ(refusal({}), ReportRefusal::size);
  EXPECT_EQ(refusal(ReportBytes(good).first(63)), ReportRefusal::size);
  EXPECT_EQ(refusal(with(0, 0)), ReportRefusal::magic);
  EXPECT_EQ(refusal(kOutputExample), ReportRefusal::magic);
  EXPECT_EQ(refusal(with(2, 2)), ReportRefusal::version);
  for (std::size_t bit = 24; bit < 512; ++bit) {  // after the version
    Report report = good;
    report[bit / 8] = static_cast<std::uint8_t>(report[bit / 8] ^ (1U << (bit % 8)));
    EXPECT_EQ(refusal(report), ReportRefusal::checksum) << "bit " << bit;
  }
  EXPECT_EQ(refusal(resealed(with(3, 0x10))), ReportRefusal::reserved);
  EXPECT_EQ(refusal(resealed(with(59, 1))), ReportRefusal::reserved);
  EXPECT_EQ(refusal(resealed(with(15, 0x7F))), ReportRefusal::range);  // 213 m
  EXPECT_EQ(refusal(resealed(with(27, 0x80))), ReportRefusal::range);  // -2147 m/s
  EXPECT_EQ(outputFrom(encode(OutputReport{true, 0, {}})).error(), ReportRefusal::range);
}

TEST(DeviceClock, SpacesMeasurementsAsTheDeviceDidHoweverLateTheyArrive) {
  DeviceClock clock;
  std::mt19937 random(1);
  std::int64_t last_ns = 0;
  std::uint32_t device_us = 0xFFFFF000;  // wraps around
  for (std::int64_t number = 0; number < 2000; ++number) {
    const std::int64_t true_ns = 5'000'000'000 + number * 1'000'000;
    const std::int64_t arrival_ns =
        true_ns + (number % 10 == 0 ? 0 : static_cast<std::int64_t>(random() % 900'000));
    const std::int64_t time_ns = clock.timeOf(device_us, arrival_ns);
    EXPECT_LE(time_ns, arrival_ns);
    // between two punctual reports the difference grows by at most 0.1 % of 10 ms
    EXPECT_NEAR(static_cast<double>(time_ns - true_ns), 0, 10'001) << number;
    if (number > 0) {
      EXPECT_NEAR(static_cast<double>(time_ns - last_ns), 1e6, 11'000) << number;
    }
    last_ns = time_ns;
    device_us += 1000;
  }
}

TEST(DeviceClock, IgnoresAClockThatJumpsOrStops) {
  DeviceClock clock;
  std::int64_t arrival_ns = 1'000'000'000;
  for (const std::uint32_t device_us :
       {0U, 1000U, 4'000'000'000U, 5U, 5U, 5U, 2'000'000'000U, 3'900'000'000U}) {
    arrival_ns += 1'000'000;
    const std::int64_t time_ns = clock.timeOf(device_us, arrival_ns);
    EXPECT_LE(time_ns, arrival_ns);
    EXPECT_GE(time_ns, arrival_ns - DeviceClock::kMaxDelayNs) << device_us;
  }
}

TEST(SpaceMouseReport, HoldsEachValueUntilANewOneArrives) {
  SpaceMouseState cap;
  EXPECT_TRUE(takeOver(cap, bytesOf("01 5E 01 A2 FE 00 00")));  // 350, -350, 0
  EXPECT_TRUE(takeOver(cap, bytesOf("02 01 00 02 00 03 00")));
  EXPECT_TRUE(takeOver(cap, bytesOf("03 02 00")));
  EXPECT_TRUE(takeOver(cap, bytesOf("17 50")));  // the battery
  EXPECT_EQ(cap.translation, (std::array<std::int16_t, 3>{350, -350, 0}));
  EXPECT_EQ(cap.rotation, (std::array<std::int16_t, 3>{1, 2, 3}));
  EXPECT_EQ(cap.buttons, 2U);
  EXPECT_TRUE(takeOver(cap, bytesOf("01 0A 00 14 00 1E 00 FF FF FE FF FD FF")));  // of a SpaceMouse Wireless
  EXPECT_EQ(cap.translation, (std::array<std::int16_t, 3>{10, 20, 30}));
  EXPECT_EQ(cap.rotation, (std::array<std::int16_t, 3>{-1, -2, -3}));
}

TEST(SpaceMouseReport, OfAnotherLengthOrBeyondAnyCapChangesNothing) {
  SpaceMouseState cap;
  ASSERT_TRUE(takeOver(cap, bytesOf("01 05 00 06 00 07 00")));
  for (const char* bad :
       {"", "01", "01 05 00 06 00 07", "01 00 00 00 00 00 00 00", "01 00 80 00 00 00 00",
        "01 01 00 01 00 01 00 00 00 00 00 FF 7F", "02 FF 7F 00 00 00 00", "03", "03 01 02 03 04 05 06 07"}) {
    EXPECT_FALSE(takeOver(cap, bytesOf(bad))) << bad;
  }
  EXPECT_EQ(cap.translation, (std::array<std::int16_t, 3>{5, 6, 7}));
  EXPECT_EQ(cap.rotation, (std::array<std::int16_t, 3>{}));
  EXPECT_EQ(cap.buttons, 0U);
}

TEST(SpaceMouseMotion, MovesAtFullSpeedAtFullDeflectionAndNotInTheDeadZone) {
  SpaceMouseMotion motion(0.1, 0.5);
  SpaceMouseState cap;
  // Y is towards the user, which is z here; z down is inside the dead zone.
  cap.translation = {350, -500, 17};
  for (int step = 0; step < 1000; ++step) motion.step(cap, 0.001);
  EXPECT_NEAR(motion.position_m().x, 0.1, 1e-12);  // 0.1 m/s for 1 s, rounding only
  EXPECT_NEAR(motion.position_m().z, -0.1, 1e-12);
  EXPECT_EQ(motion.position_m().y, 0);
  cap.translation = {0, 0, -350};
  motion.step(cap, 0.001);
  EXPECT_NEAR(motion.velocity_m_per_s().y, 0.1, 1e-12) << "pulled up";
  cap.translation = {18, 0, 0};
  motion.step(cap, 0.001);
  EXPECT_NEAR(motion.velocity_m_per_s().x, 0.1 / 333, 1e-12) << "grows from zero beyond the dead zone";
}

TEST(SpaceMouseMotion, EndsAtItsReachAndLeavesOutAPause) {
  SpaceMouseMotion motion(1, 0.5);
  SpaceMouseState cap;
  cap.translation = {350, 0, 0};
  motion.step(cap, 3600);
  EXPECT_NEAR(motion.position_m().x, SpaceMouseMotion::kMaxStepS, 1e-12);
  for (int step = 0; step < 1000; ++step) motion.step(cap, 0.001);
  EXPECT_EQ(motion.position_m().x, 0.5);
  EXPECT_EQ(motion.velocity_m_per_s().x, 0);
}

TEST(HidId, IsReadAsLsusbShowsItAndOtherwiseRefused) {
  EXPECT_EQ(hidIdFrom("046d:C626").value(), (HidId{0x046D, 0xC626}));
  EXPECT_EQ(textOf(HidId{0x046D, 0xC626}), "046d:c626");
  for (const char* bad : {"", "046d", "046d:", "46d:c626", "046dc626", "046d:c62g", "046d-c626", "0x46:c626",
                          "046d:c6260", "-46d:c626", "+46d:c626", "0000:c626"}) {
    EXPECT_FALSE(hidIdFrom(bad)) << bad;
  }
}

}  // namespace
}  // namespace hapticd::drivers
