// SPDX-License-Identifier: Apache-2.0
#include "fake_falcon.h"

#include <algorithm>

namespace hapticd::test {
namespace {

constexpr int kPurgeReceived = 1;
constexpr int kBootloaderBaud = 0x4138;
constexpr int kImageBaud = 0x0015;
constexpr int kFirmwareBaud = 0x0002;
constexpr FakeFalcon::Counts kUnhomedOffset{1200, -900, 333};
constexpr int kEnd = 650;  // position of the encoders' end stops

void putNumber(std::array<std::uint8_t, 16>& frame, std::size_t at, int number) {
  for (std::size_t nibble = 0; nibble < 4; ++nibble) {
    frame[at + nibble] = static_cast<std::uint8_t>('A' + ((number >> (4 * nibble)) & 0xF));
  }
}

int numberAt(std::span<const std::uint8_t> frame, std::size_t at) {
  int number = 0;
  for (std::size_t nibble = 0; nibble < 4; ++nibble) number |= (frame[at + nibble] - 'A') << (4 * nibble);
  return number >= 0x8000 ? number - 0x10000 : number;
}

}  // namespace

void FakeFalcon::moveTo(const Counts& counts) {
  const std::lock_guard lock(mutex);
  counts_ = counts;
  for (std::size_t k = 0; k < 3; ++k) {
    was_outside_[k] = was_outside_[k] || counts[k] >= kEnd;
    homed_[k] = homed_[k] || (was_outside_[k] && counts[k] <= -kEnd);
  }
}

void FakeFalcon::loseEverything() {
  const std::lock_guard lock(mutex);
  has_firmware = false;
  was_outside_ = {};
  homed_ = {};
  stage_ = Stage::idle;
  pending_.clear();
}

void FakeFalcon::take(Request request) {
  const std::lock_guard lock(mutex);
  requests.push_back(request);
  const auto [kind, value] = request;
  if (kind == 0 && value == kPurgeReceived) pending_.clear();
  if (kind == 1 && (value == 0x0100 || value == 0x0101)) {
    const bool rises = value == 0x0101 && !dtr_;
    dtr_ = value == 0x0101;
    if (rises && baud_ == kBootloaderBaud && !rts_ && plain_format_) {
      stage_ = Stage::greeting;
      has_firmware = false;
      image.clear();
    }
  }
  if (kind == 1 && (value == 0x0200 || value == 0x0202)) rts_ = value == 0x0202;
  if (kind == 3) baud_ = value;
  if (kind == 4) plain_format_ = value == 0x0008;
  if (kind == 9) latency_ms_ = value;
}

void FakeFalcon::take(std::span<const std::uint8_t> bytes) {
  const std::lock_guard lock(mutex);
  if (has_firmware) {
    if (baud_ == kFirmwareBaud && latency_ms_ == 1) takeOrder(bytes);
  } else {
    takeInBootloader(bytes);
  }
}

void FakeFalcon::takeInBootloader(std::span<const std::uint8_t> bytes) {
  constexpr std::array<std::uint8_t, 3> kGreeting{0x0A, 0x43, 0x0D};
  constexpr std::array<std::uint8_t, 5> kReply{0x00, 0x0A, 0x44, 0x2C, 0x0D};
  if (stage_ == Stage::greeting && baud_ == kBootloaderBaud && std::ranges::equal(bytes, kGreeting)) {
    if (unanswered_greetings-- > 0) return;
    queue(std::span(kReply).subspan(zero_before_greeting ? 0 : 1));
    stage_ = Stage::image_announced;
    return;
  }
  if (baud_ != kImageBaud || dtr_) return;
  if (stage_ == Stage::image_announced && bytes.size() == 1 && bytes[0] == 0x41) {
    queue(bytes);
    stage_ = Stage::image;
    return;
  }
  if (stage_ != Stage::image || bytes.size() > 62) return;
  std::vector<std::uint8_t> echo(bytes.begin(), bytes.end());
  if (image.empty() && wrong_echoes-- > 0) echo[0] ^= 0x55;
  image.insert(image.end(), bytes.begin(), bytes.end());
  queue(echo);
  has_firmware = image.size() == image_bytes;
}

void FakeFalcon::takeOrder(std::span<const std::uint8_t> bytes) {
  const auto isNibble = [](std::uint8_t byte) { return byte >= 0x41 && byte <= 0x50; };
  if (bytes.size() != 16 || bytes[0] != '<' || bytes[15] != '>' ||
      !std::ranges::all_of(bytes.subspan(1, 13), isNibble)) {
    ++wrong_orders;
    return;
  }
  ++orders;
  motors = {numberAt(bytes, 1), numberAt(bytes, 5), numberAt(bytes, 9)};
  control = bytes[13] - 'A';
  if (!mute) reply();
}

void FakeFalcon::reply() {
  std::array<std::uint8_t, 16> frame{};
  frame[0] = '<';
  frame[14] = 'A';
  frame[15] = '>';
  int state = buttons;
  for (std::size_t k = 0; k < 3; ++k) {
    putNumber(frame, 1 + 4 * k, counts_[k] + (homed_[k] ? 0 : kUnhomedOffset[k]));
    if (homed_[k] && (control & 1) != 0) state |= 0x10 << k;
  }
  frame[13] = static_cast<std::uint8_t>('A' + state);
  if (garbled && orders % 2 == 0) {
    queueDamaged(frame);
  } else {
    queue(frame);
  }
}

void FakeFalcon::queueDamaged(std::array<std::uint8_t, 16> frame) {
  for (std::size_t k = 0; k < 3; ++k) putNumber(frame, 1 + 4 * k, kGarbledCounts[k]);
  switch (damaged_replies++ % 4) {
    case 0:
      frame[6] = 'Q';  // one above the largest nibble
      break;
    case 1:
      frame[15] = 'A';
      break;
    case 2:
      frame[0] = 0x1A;
      break;
    default:
      queue(std::span(frame).first(14));  // the known fault: a reply of 14 bytes
      return;
  }
  queue(frame);
}

void FakeFalcon::queue(std::span<const std::uint8_t> bytes) {
  pending_.insert(pending_.end(), bytes.begin(), bytes.end());
}

std::size_t FakeFalcon::give(std::span<std::uint8_t> transfer) {
  constexpr std::size_t kMaxAtOnce = 23;  // so that echoes and replies arrive in pieces
  const std::lock_guard lock(mutex);
  transfer[0] = 0x31;
  transfer[1] = 0x60;
  const bool odd = orders % 2 == 1;
  const std::size_t max_bytes =
      std::min<std::size_t>(has_firmware && odd ? 9 : kMaxAtOnce, transfer.size() - 2);
  const std::size_t bytes = std::min(pending_.size(), max_bytes);
  std::copy_n(pending_.begin(), bytes, transfer.begin() + 2);
  pending_.erase(pending_.begin(), pending_.begin() + static_cast<std::ptrdiff_t>(bytes));
  return 2 + bytes;
}

}  // namespace hapticd::test
