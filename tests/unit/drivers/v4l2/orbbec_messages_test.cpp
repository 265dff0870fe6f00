// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/v4l2/orbbec_messages.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/support/video/realsense_tables.h"

namespace hapticd::drivers::orbbec {
namespace {

using test::put;
using Message = std::vector<std::byte>;

const Request kRequest{Operation::get_property, 7, kDepthUnitProperty};

Message response() {
  Message bytes(64);
  put(bytes, 0, std::uint16_t{0x4252});
  put(bytes, 2, std::uint16_t{11});  // the error and five numbers, in halfwords
  put(bytes, 4, std::uint16_t{1});
  put(bytes, 6, std::uint16_t{7});
  put(bytes, 10, 0.1F);
  return bytes;
}

Message calibrations() {
  Message list(2 * 152);
  for (std::size_t item = 0; item < 2; ++item) {
    const std::size_t offset = item * 152;
    put(list, offset, item == 0 ? 600.0F : 450.0F);
    put(list, offset + 4, item == 0 ? 600.0F : 450.0F);
    put(list, offset + 8, item == 0 ? 639.5F : 420.0F);
    put(list, offset + 12, item == 0 ? 399.5F : 241.0F);
    put(list, offset + 16, static_cast<std::int16_t>(item == 0 ? 1280 : 848));
    put(list, offset + 18, static_cast<std::int16_t>(item == 0 ? 800 : 480));
  }
  return list;
}

TEST(Orbbec, ARequestHasMagicLengthOperationIdAndProperty) {
  const Message bytes = encoded({Operation::read_list, 3, 4027, {768, 16}});
  Message expected(64);
  put(expected, 0, std::uint16_t{0x4D47});
  put(expected, 2, std::uint16_t{6});
  put(expected, 4, std::uint16_t{30});
  put(expected, 6, std::uint16_t{3});
  put(expected, 8, std::uint32_t{4027});
  put(expected, 12, std::uint32_t{768});
  put(expected, 16, std::uint32_t{16});
  EXPECT_EQ(bytes, expected);
}

TEST(Orbbec, ReadsTheDepthUnitInMillimetres) {
  const auto data = responseData(kRequest, response());
  ASSERT_TRUE(data) << data.error().text();
  ASSERT_EQ(data->size(), 20U);
  const auto unit_m = depthUnit_mFrom(*data);
  ASSERT_TRUE(unit_m);
  EXPECT_NEAR(*unit_m, 1e-4, 1e-10);  // of single precision
}

TEST(Orbbec, ReadsTheIntrinsicsOfAListedMode) {
  const auto pinhole = pinholeOfMode(calibrations(), {848, 480});
  ASSERT_TRUE(pinhole) << pinhole.error().text();
  EXPECT_EQ(pinhole->fx_px, 450);
  EXPECT_EQ(pinhole->cy_px, 241);
}

TEST(Orbbec, ScalesTheIntrinsicsOfAModeOfTheSameProportions) {
  const auto pinhole = pinholeOfMode(calibrations(), {640, 400});
  ASSERT_TRUE(pinhole) << pinhole.error().text();
  EXPECT_EQ(pinhole->fx_px, 300);
  EXPECT_EQ(pinhole->cx_px, 319.5);
  EXPECT_EQ(pinhole->cy_px, 199.5);
}

struct Damage {
  std::string name;
  std::function<std::string()> error;
  std::string expected;
};

template <typename T>
std::string errorOf(const base::Result<T>& result) {
  return result ? "accepted" : result.error().text();
}

std::string responseError(const std::function<void(Message&)>& damage) {
  Message bytes = response();
  damage(bytes);
  return errorOf(responseData(kRequest, bytes));
}

std::string unitError(float unit_mm) {
  Message data(20);
  put(data, 0, unit_mm);
  return errorOf(depthUnit_mFrom(data));
}

std::string modeError(const std::function<void(Message&)>& damage, FrameSize size = {848, 480}) {
  Message list = calibrations();
  damage(list);
  return errorOf(pinholeOfMode(list, size));
}

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

const std::vector<Damage> kDamages{
    {"Short", [] { return responseError([](Message& m) { m.resize(9); }); }, "only 9 bytes"},
    {"Magic", [] { return responseError([](Message& m) { put(m, 0, std::uint16_t{1}); }); }, "begins with"},
    {"Operation", [] { return responseError([](Message& m) { put(m, 4, std::uint16_t{2}); }); }, "is to 2"},
    {"Id", [] { return responseError([](Message& m) { put(m, 6, std::uint16_t{8}); }); },
     "request 7 is to 8"},
    {"Error", [] { return responseError([](Message& m) { put(m, 8, std::uint16_t{2}); }); }, "error 0x0002"},
    {"Long", [] { return responseError([](Message& m) { put(m, 2, std::uint16_t{29}); }); }, "states 58"},
    {"NoLength", [] { return responseError([](Message& m) { put(m, 2, std::uint16_t{0}); }); }, "states 0"},
    {"NaNUnit", [] { return unitError(kNaN); }, "is nan"},
    {"NoUnit", [] { return errorOf(depthUnit_mFrom(Message(3))); }, "only 3 bytes"},
    {"PartOfAMode", [] { return modeError([](Message& m) { m.resize(200); }); }, "200 bytes are not a list"},
    {"OtherProportions",
     [] {
       return modeError([](Message&) {}, {640, 480});
     },
     "no mode of the proportions"},
    {"NaNCentre", [] { return modeError([](Message& m) { put(m, 160, kNaN); }); }, "optical centre"},
    {"ShortBaseline", [] { return errorOf(baseline_mFrom(Message(27))); }, "only 27 bytes"},
    {"ZeroBaseline", [] { return errorOf(baseline_mFrom(Message(28))); }, "baseline of 0"},
    {"EndlessList", [] { return errorOf(listSizeFrom(Message(6, std::byte{0xFF}))); }, "4294967295 bytes"},
    {"ShortVersion", [] { return errorOf(versionFrom(Message(100))); }, "only 100 bytes"},
};

class DamagedOrbbec : public testing::TestWithParam<Damage> {};

TEST_P(DamagedOrbbec, IsANamedError) {
  EXPECT_NE(GetParam().error().find(GetParam().expected), std::string::npos) << GetParam().error();
}
INSTANTIATE_TEST_SUITE_P(Messages, DamagedOrbbec, testing::ValuesIn(kDamages),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace hapticd::drivers::orbbec
