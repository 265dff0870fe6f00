// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/falcon/falcon_firmware.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <span>

#include "config/base/file_content.h"
#include "drivers/handle/falcon/falcon_link.h"

namespace hapticd::drivers {
namespace {

using Bytes = std::span<const std::uint8_t>;
using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr std::uint16_t kLatencyMs = 16;
constexpr milliseconds kSendLimit{500};
constexpr milliseconds kGreetingLimit{30};  // 4 bytes at 9600 baud plus the latency timer
constexpr milliseconds kEchoLimit{500};     // for a chunk: 5 ms on the line plus the latency timer
constexpr int kMaxGreetings = 100;
constexpr std::size_t kChunkBytes = 62;  // one USB packet without its status bytes

constexpr std::array<std::uint8_t, 3> kGreeting{0x0A, 0x43, 0x0D};
constexpr std::array<std::uint8_t, 4> kGreetingReply{0x0A, 0x44, 0x2C, 0x0D};
constexpr std::array<std::uint8_t, 1> kImageFollows{0x41};

constexpr const char* kPowerRemedy =
    "unplug its power supply and its USB cable, wait a moment, plug both in again";

base::Error imageError(const std::string& path, std::string what) {
  return {path, std::move(what), "set falcon_handle.firmware to the image of Novint's driver"};
}

base::Error loadError(std::string what) {
  return {"falcon firmware", std::move(what), kPowerRemedy};
}

/// Receives until `enough` returns true or `limit` has passed.
template <typename Enough>
base::Result<FalconImage> receiveUntil(FtdiPort& port, milliseconds limit, Enough enough) {
  constexpr std::size_t kMaxReceived = 4096;  // for a device that never stops sending
  FalconImage received;
  const Clock::time_point deadline = Clock::now() + limit;
  while (!enough(received) && received.size() < kMaxReceived && Clock::now() < deadline) {
    const auto bytes = port.read(limit);
    if (!bytes) return std::unexpected(bytes.error());
    received.insert(received.end(), bytes->begin(), bytes->end());
  }
  return received;
}

base::Result<void> resetBootloader(FtdiPort& port) {
  if (auto done = port.purge(); !done) return done;
  if (auto done = port.setLatency(kLatencyMs); !done) return done;
  if (auto done = port.setBaud(FtdiPort::Baud::of_bootloader); !done) return done;
  if (auto done = port.setPlainFormat(); !done) return done;
  if (auto done = port.setRts(false); !done) return done;
  if (auto done = port.setDtr(false); !done) return done;
  return port.setDtr(true);
}

/// The reply may be preceded by a zero and by replies to earlier greetings.
bool holdsGreetingReply(Bytes received) {
  return !std::ranges::search(received, kGreetingReply).empty();
}

base::Result<void> greetBootloader(FtdiPort& port, const StopSignal& stop) {
  for (int greeting = 0; greeting < kMaxGreetings && !stop.raised(); ++greeting) {
    if (auto sent = port.write(kGreeting, kSendLimit); !sent) return sent;
    const auto reply = receiveUntil(port, kGreetingLimit, holdsGreetingReply);
    if (!reply) return std::unexpected(reply.error());
    if (holdsGreetingReply(*reply)) return {};
  }
  return std::unexpected(loadError("the bootloader does not respond"));
}

/// Sends bytes and checks that the bootloader echoes each of them.
base::Result<void> sendWithEcho(FtdiPort& port, Bytes bytes, const std::string& what) {
  if (auto sent = port.write(bytes, kSendLimit); !sent) return sent;
  const auto echo =
      receiveUntil(port, kEchoLimit, [&](Bytes received) { return received.size() >= bytes.size(); });
  if (!echo) return std::unexpected(echo.error());
  if (std::ranges::equal(*echo, bytes)) return {};
  return std::unexpected(loadError(
      fmt::format("{}: the bootloader sent back {}", what,
                  echo->size() == bytes.size() ? "other bytes"
                                               : fmt::format("{} of {} bytes", echo->size(), bytes.size()))));
}

base::Result<void> sendImage(FtdiPort& port, Bytes image, const StopSignal& stop) {
  for (std::size_t at = 0; at < image.size(); at += kChunkBytes) {
    if (stop.raised()) return std::unexpected(loadError("stopped"));
    const Bytes chunk = image.subspan(at, std::min(kChunkBytes, image.size() - at));
    if (auto sent = sendWithEcho(port, chunk, fmt::format("byte {} of the image", at)); !sent) return sent;
  }
  return {};
}

}  // namespace

base::Result<FalconImage> readFalconImage(const std::string& path) {
  const auto content = base::fileContent(path, {.longest = kMaxFalconImage});
  if (!content && content.error().reason == base::FileFault::Reason::too_long) {
    return std::unexpected(
        imageError(path, fmt::format("has more than {} bytes: not a firmware image", kMaxFalconImage)));
  }
  if (!content) return std::unexpected(imageError(path, content.error().text()));
  if (content->empty()) return std::unexpected(imageError(path, "is empty"));
  FalconImage image(content->size());
  std::memcpy(image.data(), content->data(), content->size());
  return image;
}

base::Result<bool> falconAnswers(FtdiPort& port, const StopSignal& stop) {
  constexpr int kMaxExchanges = 100;  // exchanges of at most FalconLink::kReplyLimit each
  FalconLink link(port);
  if (auto begun = link.begin(); !begun) return std::unexpected(begun.error());
  for (int exchange = 0; exchange < kMaxExchanges && !stop.raised(); ++exchange) {
    if (auto sent = link.send({}); !sent) return std::unexpected(sent.error());
    const auto reply = link.receive();
    if (!reply) return std::unexpected(reply.error());
    if (*reply) return true;
  }
  return false;
}

base::Result<void> loadFalconImage(FtdiPort& port, const FalconImage& image, const StopSignal& stop) {
  if (auto done = resetBootloader(port); !done) return done;
  if (auto done = greetBootloader(port, stop); !done) return done;
  if (auto done = port.setDtr(false); !done) return done;
  if (auto done = port.setBaud(FtdiPort::Baud::of_image); !done) return done;
  if (auto done = sendWithEcho(port, kImageFollows, "announcing the image"); !done) return done;
  return sendImage(port, image, stop);
}

}  // namespace hapticd::drivers
