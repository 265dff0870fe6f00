// SPDX-License-Identifier: Apache-2.0
// The extension units of the emulated depth cameras, asked as their vendors' libraries ask.

#include <gtest/gtest.h>

#include <cerrno>
#include <cmath>

#include "tests/vm/emulators/tests/uvc_rig.h"

namespace hapticd::test {
namespace {

constexpr std::uint16_t kUnit = 0x0300;

void add(Bytes& bytes, std::uint32_t value, unsigned count = 4) {
  for (unsigned i = 0; i < count; ++i) bytes.push_back(static_cast<std::uint8_t>(value >> 8 * i & 0xff));
}

/// CRC-32 bit by bit, reflected polynomial 0xEDB88320.
std::uint32_t checksum(const Bytes& bytes, std::size_t from) {
  std::uint32_t crc = 0xffffffff;
  for (std::size_t i = from; i < bytes.size(); ++i) {
    crc ^= bytes[i];
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ ((crc & 1) != 0 ? 0xedb88320 : 0);
  }
  return ~crc;
}

class EmulatedRealsenseUnit : public testing::Test {
 protected:
  /// The whole reply of 1024 bytes to a command of the hardware monitor.
  Bytes ask(std::uint32_t opcode, std::uint32_t p1 = 0, std::uint32_t p2 = 0, const Bytes& data = {}) {
    Bytes request;
    add(request, static_cast<std::uint32_t>(20 + data.size()), 2);
    add(request, 0xcdab, 2);
    for (const std::uint32_t value : {opcode, p1, p2, 0U, 0U}) add(request, value);
    request.insert(request.end(), data.begin(), data.end());
    request.resize(1024);
    EXPECT_EQ(rig_.set(1, kUnit, request).status, 0);
    return rig_.get(0x81, 1, kUnit, 1024).data;
  }
  /// The data of the reply, which must echo the opcode.
  Bytes answer(std::uint32_t opcode, std::uint32_t p1 = 0, std::uint32_t p2 = 0, const Bytes& data = {}) {
    const Bytes reply = ask(opcode, p1, p2, data);
    EXPECT_EQ(word(reply, 0), opcode);
    return {reply.begin() + 4, reply.begin() + 4 + word(reply, 1020)};
  }

  UvcRig rig_{uvc::realsenseD435()};
};

TEST_F(EmulatedRealsenseUnit, StatesTheLengthOfEachControl) {
  EXPECT_EQ(rig_.get(0x85, 1, kUnit, 2).data, (Bytes{0, 4}));
  EXPECT_EQ(rig_.get(0x85, 3, kUnit, 2).data, (Bytes{4, 0}));
  EXPECT_EQ(rig_.get(0x86, 1, kUnit, 1).data, Bytes{3}) << "can be read and written";
  EXPECT_EQ(rig_.get(0x85, 30, kUnit, 2).status, -EPIPE);
}

TEST_F(EmulatedRealsenseUnit, TellsFirmwareAndSerialNumber) {
  const Bytes details = answer(0x10);
  EXPECT_EQ(Bytes(details.begin() + 12, details.begin() + 16), (Bytes{1, 0, 16, 5})) << "5.16.0.1";
  EXPECT_EQ(Bytes(details.begin() + 48, details.begin() + 54), (Bytes{0x81, 0x35, 0x22, 0x07, 0x01, 0x23}));
}

TEST_F(EmulatedRealsenseUnit, ListsTheIntrinsicsOfEachMode) {
  const Bytes modes = answer(0x7e);
  ASSERT_EQ(modes.size(), 6 * 20U);
  EXPECT_EQ(word(modes, 20, 2), 848U);
  EXPECT_EQ(word(modes, 22, 2), 480U);
  EXPECT_NEAR(real(modes, 24), 424, 1e-3) << "90 degrees over 848 pixels";
  EXPECT_NEAR(real(modes, 32), 425.75, 1e-3);
}

TEST_F(EmulatedRealsenseUnit, HasACoefficientsTableWithChecksum) {
  const Bytes table = answer(0x15, 25);
  ASSERT_EQ(table.size(), 576U);
  EXPECT_EQ(word(table, 2, 2), 25U);
  EXPECT_EQ(word(table, 4), 560U);
  EXPECT_EQ(word(table, 12), checksum(table, 16));
  EXPECT_EQ(real(table, 160), -50.0F) << "baseline, mm";
  EXPECT_NEAR(real(table, 256 + 3 * 16), 424, 1e-3) << "848x480 is the fourth";
  EXPECT_NEAR(real(table, 256 + 5 * 16), 212, 1e-3) << "424x240 is the sixth";
}

TEST_F(EmulatedRealsenseUnit, TakesAnotherDepthUnitAndSendsDepthInIt) {
  EXPECT_EQ(word(answer(0x2c, 9), 0), 1000U);
  Bytes table;
  for (const std::uint32_t value : {100U, 0U, 65535U, 0U, 0U}) add(table, value);
  answer(0x2b, 9, 0, table);
  EXPECT_EQ(word(answer(0x2c, 9), 0), 100U);
  EXPECT_EQ(word(answer(0x2c, 9, 1), 0), 40U) << "least";
  rig_.commit(6, 333333);
  const Bytes payload = rig_.payload();
  // the plane at the principal point, z = 0.6 m, behind the sphere's lower edge
  EXPECT_NEAR(word(payload, payload.size() - 2, 2),
              0.6e4 / (1 + 0.25 * (423 - 213.75) / 212 + 0.1 * (239 - 117.75) / 212), 1);
}

TEST_F(EmulatedRealsenseUnit, RefusesWhatItDoesNotKnow) {
  EXPECT_GT(word(ask(0x99), 0), 0x80000000U) << "an error is negative";
  EXPECT_GT(word(ask(0x15, 31), 0), 0x80000000U);
  Bytes unit;
  for (const std::uint32_t value : {7U, 0U, 65535U, 0U, 0U}) add(unit, value);
  EXPECT_GT(word(ask(0x2b, 9, 0, unit), 0), 0x80000000U) << "7 um";
  EXPECT_EQ(rig_.set(1, kUnit, Bytes(1000)).status, -EPIPE) << "of the wrong length";
}

TEST_F(EmulatedRealsenseUnit, HasNumbersWithRanges) {
  EXPECT_EQ(word(rig_.get(0x83, 4, kUnit, 2).data, 0, 2), 360U) << "largest laser power";
  EXPECT_EQ(rig_.set(4, kUnit, {0x2c, 0x01}).status, 0);
  EXPECT_EQ(word(rig_.get(0x81, 4, kUnit, 2).data, 0, 2), 300U);
  EXPECT_EQ(rig_.set(4, kUnit, {0xff, 0xff}).status, -EPIPE);
  EXPECT_EQ(rig_.get(0x81, 9, kUnit, 4).data, (Bytes{1, 1, 31, 38})) << "temperatures";
  EXPECT_EQ(rig_.set(9, kUnit, {0, 0, 0, 0}).status, -EPIPE);
}

TEST_F(EmulatedRealsenseUnit, DamagesItsTables) {
  const auto with = [this](const char* fault, auto what) {
    rig_.tell(std::string("fault ") + fault);
    const Bytes reply = what();
    rig_.tell("resume");
    return reply;
  };
  const auto table = [this] { return answer(0x15, 25); };
  const auto modes = [this] { return answer(0x7e); };
  const Bytes crc = with("table-checksum", table);
  EXPECT_NE(word(crc, 12), checksum(crc, 16));
  EXPECT_EQ(with("table-size", table).size(), 512U);
  EXPECT_NE(word(with("table-type", table), 2, 2), 25U);
  EXPECT_EQ(real(with("table-focal-zero", table), 256 + 3 * 16), 0.0F);
  EXPECT_NE(word(with("mode-not-listed", modes), 0, 2), 640U);
  EXPECT_TRUE(std::isnan(real(with("mode-not-finite", modes), 4)));
  EXPECT_EQ(word(with("unit-zero", [this] { return answer(0x2c, 9); }), 0), 0U);
  EXPECT_EQ(word(with("disparity", [this] { return answer(0x2c, 9); }), 12), 1U);
  EXPECT_GT(word(with("no-mode-table", [this] { return ask(0x7e); }), 0), 0x80000000U);
  EXPECT_GT(word(with("monitor-error", [this] { return ask(0x10); }), 0), 0x80000000U);
  EXPECT_EQ(word(with("monitor-echo", [this] { return ask(0x10); }), 0), 0x11U);
  EXPECT_GT(word(with("monitor-length", [this] { return ask(0x10); }), 1020), 1016U);
  EXPECT_EQ(answer(0x15, 25).size(), 576U);
}

TEST_F(EmulatedRealsenseUnit, DamagesItsControls) {
  rig_.tell("fault unit-length");
  EXPECT_EQ(rig_.get(0x85, 1, kUnit, 2).data, (Bytes{7, 0}));
  rig_.tell("fault unit-stalls");
  EXPECT_EQ(rig_.get(0x85, 1, kUnit, 2).status, -EPIPE);
}

class EmulatedOrbbecUnit : public testing::Test {
 protected:
  Bytes ask(std::uint16_t opcode, const std::vector<std::uint32_t>& words, std::uint8_t reply_selector = 2) {
    Bytes request;
    add(request, 0x4d47, 2);
    add(request, static_cast<std::uint32_t>(words.size() * 2), 2);
    add(request, opcode, 2);
    add(request, 7, 2);
    for (const std::uint32_t value : words) add(request, value);
    request.resize(64);
    EXPECT_EQ(rig_.set(2, kUnit, request).status, 0);
    const std::uint16_t reply_bytes = reply_selector == 3 ? 1024 : reply_selector == 1 ? 512 : 64;
    return rig_.get(0x81, reply_selector, kUnit, reply_bytes).data;
  }
  /// The response's data, after its header without an error.
  Bytes answer(std::uint16_t opcode, const std::vector<std::uint32_t>& words,
               std::uint8_t reply_selector = 2) {
    const Bytes reply = ask(opcode, words, reply_selector);
    EXPECT_EQ(Bytes(reply.begin(), reply.begin() + 2), (Bytes{0x52, 0x42}));
    EXPECT_EQ(word(reply, 4, 2), opcode);
    EXPECT_EQ(word(reply, 6, 2), 7U) << "the request's number";
    EXPECT_EQ(word(reply, 8, 2), 0U) << "error";
    return {reply.begin() + 10, reply.begin() + 8 + 2 * word(reply, 2, 2)};
  }

  UvcRig rig_{uvc::gemini335()};
};

TEST_F(EmulatedOrbbecUnit, TellsItsDepthUnitAndTakesAnother) {
  EXPECT_EQ(real(answer(1, {176}), 0), 1.0F);
  answer(2, {176, std::bit_cast<std::uint32_t>(0.1F)});
  EXPECT_EQ(real(answer(1, {176}), 0), 0.1F);
  EXPECT_EQ(word(answer(1, {75}), 0), 3U) << "the level of that precision";
  EXPECT_NE(word(ask(2, {75, 99}), 8, 2), 0U);
}

TEST_F(EmulatedOrbbecUnit, ListsTheParametersOfEachMode) {
  const Bytes told = answer(29, {4027});
  EXPECT_EQ(word(told, 0, 2), 0U) << "version of the structure";
  const std::uint32_t bytes = word(told, 2);
  ASSERT_EQ(bytes, 4 * 152U);
  const Bytes list = answer(30, {4027, 0, bytes}, 3);
  ASSERT_EQ(list.size(), bytes);
  // half of 848 pixels over the tangent of 43 degrees
  EXPECT_NEAR(real(list, 0), 454.69, 0.01);
  EXPECT_NEAR(real(list, 8), 425.75, 1e-3);
  EXPECT_EQ(word(list, 16, 2), 848U);
  EXPECT_EQ(word(list, 18, 2), 480U);
  EXPECT_EQ(word(list, 152 + 16, 2), 640U) << "the second mode";
  answer(31, {4027});
  EXPECT_NE(word(ask(30, {4027, 0, bytes}, 3), 8, 2), 0U) << "it has ended";
}

TEST_F(EmulatedOrbbecUnit, TellsBaselineAndFocalLength) {
  const Bytes told = answer(29, {4026});
  EXPECT_EQ(word(told, 0, 2), 1U);
  const Bytes list = answer(30, {4026, 0, word(told, 2)}, 3);
  ASSERT_EQ(list.size(), 28U);
  EXPECT_EQ(real(list, 4), 50.0F);
  EXPECT_NEAR(real(list, 12), 454.69, 0.01);
}

TEST_F(EmulatedOrbbecUnit, TellsItsVersions) {
  const Bytes versions = answer(3, {1000}, 1);
  ASSERT_EQ(versions.size(), 116U);
  const auto textAt = [&](std::size_t at) {
    return std::string(reinterpret_cast<const char*>(&versions[at]));
  };
  EXPECT_EQ(textAt(0), "1.2.20.0");
  EXPECT_EQ(textAt(80), "CP0E54000042");
}

TEST_F(EmulatedOrbbecUnit, RefusesWhatItDoesNotKnow) {
  EXPECT_NE(word(ask(1, {999}), 8, 2), 0U);
  EXPECT_NE(word(ask(99, {176}), 8, 2), 0U);
  EXPECT_NE(word(ask(30, {4027, 0, 2000}, 3), 8, 2), 0U);
  EXPECT_EQ(rig_.set(4, kUnit, Bytes(64)).status, -EPIPE);
}

TEST_F(EmulatedOrbbecUnit, DamagesItsResponses) {
  rig_.tell("fault response-magic");
  EXPECT_EQ(word(ask(1, {176}), 0, 2), 0U);
  rig_.tell("resume");
  rig_.tell("fault response-number");
  EXPECT_EQ(word(ask(1, {176}), 6, 2), 8U);
  rig_.tell("resume");
  rig_.tell("fault response-error");
  EXPECT_NE(word(ask(1, {176}), 8, 2), 0U);
  rig_.tell("resume");
  rig_.tell("fault list-size");
  EXPECT_NE(word(answer(29, {4027}), 2) % 152, 0U);
}

}  // namespace
}  // namespace hapticd::test
