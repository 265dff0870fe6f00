// SPDX-License-Identifier: Apache-2.0
// The extension units of the emulated depth cameras, asked as their vendors' libraries ask.

#include <gtest/gtest.h>

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
  /// The data of the reply to a command of the hardware monitor, which must echo the opcode.
  Bytes answer(std::uint32_t opcode, std::uint32_t p1 = 0, std::uint32_t p2 = 0, const Bytes& data = {}) {
    Bytes request;
    add(request, static_cast<std::uint32_t>(20 + data.size()), 2);
    add(request, 0xcdab, 2);
    for (const std::uint32_t value : {opcode, p1, p2, 0U, 0U}) add(request, value);
    request.insert(request.end(), data.begin(), data.end());
    request.resize(1024);
    EXPECT_EQ(rig_.set(1, kUnit, request).status, 0);
    const Bytes reply = rig_.get(0x81, 1, kUnit, 1024).data;
    EXPECT_EQ(word(reply, 0), opcode);
    return {reply.begin() + 4, reply.begin() + 4 + word(reply, 1020)};
  }

  UvcRig rig_{uvc::realsenseD435()};
};

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

}  // namespace
}  // namespace hapticd::test
