// SPDX-License-Identifier: Apache-2.0
// The packets of the UDP handle, without sockets.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "drivers/handle/udp/packet.h"
#include "udp_test_peer.h"

namespace hapticd::drivers::udp {
namespace {

using test::Bytes;
using test::RawState;

constexpr const char* kKey = "0123456789abcdef";

std::span<const std::byte> spanOf(const Bytes& bytes) {
  return std::as_bytes(std::span(bytes));
}

std::span<const std::byte> keyOf(const std::string& key) {
  return std::as_bytes(std::span(key));
}

Bytes vectorOf(const PacketBytes& packet) {
  Bytes bytes;
  for (const std::byte byte : packet.bytes()) bytes.push_back(std::to_integer<std::uint8_t>(byte));
  return bytes;
}

RawState someState() {
  return {0x1122334455667788, 42,         5'000'000'000, 0x99AA, 7, 123'456, {0.1, -0.2, 9},
          {1, -99, 0.5},      0x80000005, 2 | 4};
}

std::optional<Refusal> refusalOf(const Bytes& bytes, const std::string& key = {}) {
  const auto packet = decodeState(spanOf(bytes), keyOf(key));
  return packet ? std::nullopt : std::optional(packet.error());
}

TEST(UdpPacket, AStateIsReadAndWrittenAsDocumented) {
  for (const std::string key : {"", kKey}) {
    const RawState raw = someState();
    const Bytes bytes = test::bytesOf(raw, key);
    const auto packet = decodeState(spanOf(bytes), keyOf(key));
    ASSERT_TRUE(packet) << textOf(packet.error());
    EXPECT_EQ(packet->header.session, raw.session);
    EXPECT_EQ(packet->header.sequence, raw.sequence);
    EXPECT_EQ(packet->header.time_ns, raw.time_ns);
    EXPECT_EQ(packet->header.echo.session, raw.echo_session);
    EXPECT_EQ(packet->header.echo.sequence, raw.echo_sequence);
    EXPECT_EQ(packet->header.echo.age_ns, raw.echo_age_ns);
    EXPECT_EQ(packet->position_m_in_handle, raw.position_m);
    EXPECT_EQ(packet->velocity_m_per_s_in_handle, raw.velocity_m_per_s);
    EXPECT_EQ(packet->buttons, raw.buttons);
    EXPECT_TRUE(packet->velocity_valid && packet->calibrated && !packet->fault);
    EXPECT_EQ(vectorOf(encode(*packet, keyOf(key))), bytes);
  }
  EXPECT_EQ(test::getAt<std::uint32_t>(test::bytesOf(someState()), 108), 0x88317B0A)
      << "the example of protocol.md";
}

RawState someStateOfVersion2() {
  RawState raw = someState();
  raw.version = 2;
  raw.measured = 1 | 2;
  raw.driven = 1 | 2 | 4;
  raw.orientation = {0.1, -0.5, 0.7, 0.5};
  raw.gripper_rad = 0.25;
  raw.latency_ns = 1'500'000;
  return raw;
}

TEST(UdpPacket, AStateOfVersion2IsReadAndWrittenAsDocumented) {
  for (const std::string key : {"", kKey}) {
    const RawState raw = someStateOfVersion2();
    const Bytes bytes = test::bytesOf(raw, key);
    EXPECT_EQ(bytes.size(), key.empty() ? 168 : 200);
    const auto packet = decodeState(spanOf(bytes), keyOf(key));
    ASSERT_TRUE(packet) << textOf(packet.error());
    EXPECT_EQ(packet->header.version, 2);
    EXPECT_EQ(packet->position_m_in_handle, raw.position_m);
    ASSERT_TRUE(packet->orientation_in_handle);
    EXPECT_NEAR(packet->orientation_in_handle->y, -0.5, 1e-12);
    EXPECT_NEAR(packet->orientation_in_handle->w, 0.5, 1e-12);
    EXPECT_EQ(packet->gripper_rad, 0.25);
    EXPECT_TRUE(packet->drives_torque && packet->drives_gripper);
    EXPECT_EQ(packet->device_latency_ns, 1'500'000);
    EXPECT_EQ(vectorOf(encode(*packet, keyOf(key))), bytes);
  }
  RawState none = someStateOfVersion2();
  none.measured = 0;
  none.driven = 1;
  none.orientation = {};
  const auto packet = decodeState(spanOf(test::bytesOf(none)), {});
  ASSERT_TRUE(packet);
  EXPECT_FALSE(packet->orientation_in_handle || packet->gripper_rad || packet->drives_torque ||
               packet->drives_gripper);
}

TEST(UdpPacket, AStateOfVersion2IsRefusedWhereItsOwnFieldsAreWrong) {
  const auto refused = [](auto change) {
    RawState raw = someStateOfVersion2();
    change(raw);
    return refusalOf(test::bytesOf(raw));
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refused([](RawState&) {}), std::nullopt);
  EXPECT_EQ(refused([&](RawState& raw) { raw.orientation[2] = nan; }), Refusal::not_finite);
  EXPECT_EQ(refused([](RawState& raw) { raw.orientation = {}; }), Refusal::out_of_range);
  EXPECT_EQ(refused([](RawState& raw) { raw.orientation = {0, 0, 0, 1.02}; }), Refusal::out_of_range);
  EXPECT_EQ(refused([&](RawState& raw) { raw.gripper_rad = nan; }), Refusal::not_finite);
  EXPECT_EQ(refused([](RawState& raw) { raw.gripper_rad = 8; }), Refusal::out_of_range);
  EXPECT_EQ(refused([](RawState& raw) { raw.latency_ns = 2'000'000'000; }), Refusal::out_of_range);
  EXPECT_EQ(refused([](RawState& raw) { raw.latency_ns = std::uint64_t{1} << 63; }), Refusal::out_of_range);
  Bytes short_one = test::bytesOf(someState());
  short_one[4] = 2;
  EXPECT_EQ(refusalOf(short_one), Refusal::wrong_size);
}

TEST(UdpPacket, TorqueAndGripperForceTravelInVersion2Only) {
  CommandPacket command;
  command.header = {3, 4, 5, {6, 7, 8}};
  command.active = true;
  command.torque_n_m_in_handle = {0.1, -0.2, 0.3};
  command.gripper_force_n = -2;
  Bytes bytes = vectorOf(encode(command, {}));
  ASSERT_EQ(bytes.size(), 168);
  EXPECT_EQ(test::getAt<double>(bytes, 120), -0.2);
  EXPECT_EQ(test::getAt<double>(bytes, 136), -2);
  auto read = decodeCommand(spanOf(bytes), {});
  ASSERT_TRUE(read);
  EXPECT_EQ(read->torque_n_m_in_handle, command.torque_n_m_in_handle);
  EXPECT_EQ(read->gripper_force_n, -2);
  test::putAt(bytes, 112, 101.0);
  EXPECT_EQ(decodeCommand(spanOf(test::sealedAgain(bytes)), {}).error(), Refusal::out_of_range);
  command.header.version = 1;
  read = decodeCommand(encode(command, {}).bytes(), {});
  ASSERT_TRUE(read);
  EXPECT_EQ(read->torque_n_m_in_handle, rt::Vec3{});
  EXPECT_EQ(read->gripper_force_n, 0);
}

TEST(UdpPacket, ACommandIsReadAndWrittenAsDocumented) {
  CommandPacket command;
  command.header = {3, 4, 5, {6, 7, 8}, 1};
  command.force_n_in_handle = {1, -2, 3.5};
  command.active = true;
  command.tick = 123456;
  command.tick_ns = 5'000'000'001;
  for (const std::string key : {"", kKey}) {
    const PacketBytes packet = encode(command, keyOf(key));
    const Bytes bytes = vectorOf(packet);
    EXPECT_EQ(bytes, test::sealedAgain(bytes, key));
    const test::RawCommand raw = test::commandIn(bytes);
    EXPECT_EQ(bytes[5], 2) << "kind";
    EXPECT_EQ(raw.session, 3U);
    EXPECT_EQ(raw.sequence, 4U);
    EXPECT_EQ(raw.echo_session, 6U);
    EXPECT_EQ(raw.echo_sequence, 7U);
    EXPECT_EQ(raw.force_n, command.force_n_in_handle);
    EXPECT_EQ(raw.mode, 1U);
    EXPECT_EQ(test::getAt<std::uint64_t>(bytes, 80), 123456U);
    EXPECT_EQ(test::getAt<std::int64_t>(bytes, 88), 5'000'000'001);
    const auto read = decodeCommand(packet.bytes(), keyOf(key));
    ASSERT_TRUE(read) << textOf(read.error());
    EXPECT_EQ(read->force_n_in_handle, command.force_n_in_handle);
    EXPECT_TRUE(read->active);
    EXPECT_EQ(read->tick, 123456U);
    EXPECT_EQ(read->tick_ns, 5'000'000'001);
    EXPECT_EQ(refusalOf(bytes, key), Refusal::other_kind);
  }
}

TEST(UdpPacket, DampingAtTheDeviceIsOfferedAndAcceptedInFieldsThatOlderVersionsIgnore) {
  CommandPacket command;
  command.header = {3, 4, 5, {6, 7, 8}};
  command.may_damp = true;
  command.contact_damping_n_s_per_m = 6.5;
  Bytes bytes = vectorOf(encode(command, {}));
  EXPECT_EQ(test::getAt<std::uint32_t>(bytes, 96), 1U);
  EXPECT_EQ(test::getAt<std::uint32_t>(bytes, 100), 0x40D00000U) << "6.5 as binary32";
  const auto read = [](const Bytes& of) { return decodeCommand(std::as_bytes(std::span(of)), {}); };
  ASSERT_TRUE(read(bytes));
  EXPECT_TRUE(read(bytes)->may_damp);
  EXPECT_EQ(read(bytes)->contact_damping_n_s_per_m, 6.5);
  const auto withDamping = [&](float damping) {
    test::putAt(bytes, 100, std::bit_cast<std::uint32_t>(damping));
    return read(test::sealedAgain(bytes));
  };
  EXPECT_EQ(withDamping(-1).error(), Refusal::out_of_range);
  EXPECT_EQ(withDamping(1001).error(), Refusal::out_of_range);
  EXPECT_EQ(withDamping(std::numeric_limits<float>::quiet_NaN()).error(), Refusal::not_finite);

  // What a hapticd from before the offer sends there, and the reply of a bridge that damps.
  command.may_damp = false;
  EXPECT_FALSE(read(vectorOf(encode(command, {})))->may_damp);
  StatePacket state;
  state.header = {3, 4, 5, {6, 7, 8}};
  EXPECT_EQ(test::getAt<std::uint16_t>(vectorOf(encode(state, {})), 6), 0U);
  state.damps = true;
  const Bytes damping = vectorOf(encode(state, {}));
  EXPECT_EQ(test::getAt<std::uint16_t>(damping, 6), 16U);
  EXPECT_TRUE(decodeState(std::as_bytes(std::span(damping)), {})->damps);
}

TEST(UdpPacket, EachRefusalHasItsReason) {
  const Bytes good = test::bytesOf(someState());
  const auto changed = [&](std::size_t at, auto number) {
    Bytes bytes = good;
    test::putAt(bytes, at, number);
    return test::sealedAgain(bytes);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  constexpr std::uint64_t kHuge = std::uint64_t{1} << 63;
  EXPECT_EQ(refusalOf(good), std::nullopt);
  EXPECT_EQ(refusalOf({}), Refusal::wrong_size);
  EXPECT_EQ(refusalOf(Bytes(good.begin(), good.end() - 1)), Refusal::wrong_size);
  EXPECT_EQ(refusalOf(Bytes(145)), Refusal::wrong_size);
  EXPECT_EQ(refusalOf(changed(0, std::uint8_t{'h'})), Refusal::not_this_protocol);
  EXPECT_EQ(refusalOf(changed(4, std::uint8_t{0})), Refusal::other_version);
  EXPECT_EQ(refusalOf(changed(4, std::uint8_t{3})), Refusal::other_version);
  EXPECT_EQ(refusalOf(changed(5, std::uint8_t{2})), Refusal::other_kind);
  EXPECT_EQ(refusalOf(changed(5, std::uint8_t{0})), Refusal::other_kind);
  EXPECT_EQ(refusalOf(changed(6, std::uint16_t{32})), Refusal::unknown_flags);
  EXPECT_EQ(refusalOf(changed(8, std::uint64_t{0})), Refusal::impossible_header);
  EXPECT_EQ(refusalOf(changed(16, std::uint64_t{0})), Refusal::impossible_header);
  EXPECT_EQ(refusalOf(changed(16, kHuge)), Refusal::impossible_header);
  EXPECT_EQ(refusalOf(changed(24, std::int64_t{-1})), Refusal::impossible_header);
  EXPECT_EQ(refusalOf(changed(24, std::numeric_limits<std::int64_t>::max())), Refusal::impossible_header);
  EXPECT_EQ(refusalOf(changed(32, std::uint64_t{0})), Refusal::impossible_header) << "a number of nobody";
  EXPECT_EQ(refusalOf(changed(48, kHuge)), Refusal::impossible_header);
  for (std::size_t at = 56; at < 104; at += 8) {
    EXPECT_EQ(refusalOf(changed(at, nan)), Refusal::not_finite);
    EXPECT_EQ(refusalOf(changed(at, -infinity)), Refusal::not_finite);
    EXPECT_EQ(refusalOf(changed(at, 1e308)), Refusal::out_of_range);
    EXPECT_EQ(refusalOf(changed(at, at < 80 ? 10.1 : -100.1)), Refusal::out_of_range);
  }
}

TEST(UdpPacket, EachFlippedBitIsDetected) {
  for (const Bytes& good : {test::bytesOf(someState()), test::bytesOf(someStateOfVersion2())})
    for (std::size_t bit = 0; bit < good.size() * 8; ++bit) {
      Bytes bytes = good;
      bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ (1U << (bit % 8)));
      EXPECT_NE(refusalOf(bytes), std::nullopt) << "bit " << bit;
    }
}

}  // namespace
}  // namespace hapticd::drivers::udp
