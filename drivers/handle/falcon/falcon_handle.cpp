// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/falcon/falcon_handle.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "config/base/error.h"
#include "config/base/file_content.h"
#include "drivers/base/stop_signal.h"
#include "drivers/handle/command_gate.h"
#include "drivers/handle/falcon/falcon_arm.h"
#include "drivers/handle/falcon/ftdi_port.h"
#include "drivers/handle/handle_frame.h"
#include "rt/base/clock.h"

namespace hapticd::drivers {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr std::chrono::milliseconds kSendLimit{100};
constexpr std::uint16_t kLatencyMs = 1;
constexpr std::chrono::milliseconds kLastRead{2 * kLatencyMs};

/// Exchanges orders and replies with the firmware, which replies to each order and sends nothing else.
/// Thread: the port's.  RT: not safe.
class FalconLink {
 public:
  /// A reply takes about 1 ms because of the latency timer; after this time it counts as lost.
  static constexpr std::chrono::milliseconds kReplyLimit{10};

  explicit FalconLink(FtdiPort& port) : port_(port) {}

  /// Sets the firmware's baud rate and the shortest latency, and discards pending bytes.
  base::Result<void> begin() {
    replies_.reset();
    if (auto done = port_.setLatency(kLatencyMs); !done) return done;
    if (auto done = port_.setBaud(FtdiPort::Baud::of_firmware); !done) return done;
    return port_.purge();
  }

  /// Sends an order.  Errors: the device is gone.
  base::Result<void> send(const FalconOrder& order) { return port_.write(frameOf(order), kSendLimit); }

  /// Waits for the reply to the last order; nothing if no complete reply has arrived by a last read after
  /// kReplyLimit.
  /// Errors: the device is gone.
  base::Result<std::optional<FalconReply>> receive() {
    const Clock::time_point deadline = Clock::now() + kReplyLimit;
    std::optional<FalconReply> newest;
    for (bool late = false; !newest && !late;) {
      late = Clock::now() >= deadline;  // one more read: the reply may have come while this thread had no CPU
      const auto bytes = port_.read(late ? kLastRead : kReplyLimit);
      if (!bytes) return std::unexpected(bytes.error());
      for (const std::uint8_t byte : *bytes) {
        if (const auto reply = replies_.add(byte)) newest = reply;
      }
    }
    if (newest) return newest;
    // A late reply would be mistaken for the reply to the next order.
    replies_.reset();
    if (auto purged = port_.purge(); !purged) return std::unexpected(purged.error());
    return std::nullopt;
  }

  /// Returns how often invalid data was received.
  std::uint64_t damaged() const { return replies_.damaged(); }

 private:
  FtdiPort& port_;
  FalconReplyStream replies_;
};

// Loading the firmware, which the device loses without power; its bootloader receives it over the serial
// line.

using FalconImage = std::vector<std::uint8_t>;
using Bytes = std::span<const std::uint8_t>;

constexpr std::size_t kMaxFalconImage = 64 * 1024;  // bytes

constexpr std::uint16_t kLoadingLatencyMs = 16;
constexpr milliseconds kLoadingSendLimit{500};
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
  if (auto done = port.setLatency(kLoadingLatencyMs); !done) return done;
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
    if (auto sent = port.write(kGreeting, kLoadingSendLimit); !sent) return sent;
    const auto reply = receiveUntil(port, kGreetingLimit, holdsGreetingReply);
    if (!reply) return std::unexpected(reply.error());
    if (holdsGreetingReply(*reply)) return {};
  }
  return std::unexpected(loadError("the bootloader does not respond"));
}

/// Sends bytes and checks that the bootloader echoes each of them.
base::Result<void> sendWithEcho(FtdiPort& port, Bytes bytes, const std::string& what) {
  if (auto sent = port.write(bytes, kLoadingSendLimit); !sent) return sent;
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

/// Reads a firmware image.
/// Errors: no such file, not readable, empty, larger than kMaxFalconImage.
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

/// Returns whether a firmware responds; takes up to 1 s if none does. Returns false if `stop` was raised.
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

/// Loads the image once, which takes seconds. A bootloader that has just been powered may need several tries.
/// Errors: the step that failed; `stop` was raised.
base::Result<void> loadFalconImage(FtdiPort& port, const FalconImage& image, const StopSignal& stop) {
  if (auto done = resetBootloader(port); !done) return done;
  if (auto done = greetBootloader(port, stop); !done) return done;
  if (auto done = port.setDtr(false); !done) return done;
  if (auto done = port.setBaud(FtdiPort::Baud::of_image); !done) return done;
  if (auto done = sendWithEcho(port, kImageFollows, "announcing the image"); !done) return done;
  return sendImage(port, image, stop);
}

constexpr milliseconds kRetryPeriod{1000};
constexpr milliseconds kReportPeriod{100};
constexpr milliseconds kSilenceLimit{100};  // without a complete reply; then the device is lost
constexpr int kMaxLoads = 10;

constexpr const char* kHomingAdvice = "pull the grip fully out, then push it fully in";

/// Mean duration of an exchange over about the last kWeight ones.
class ExchangeTime {
 public:
  void add(std::int64_t duration_ns) {
    constexpr double kWeight = 64;
    const double duration_s = static_cast<double>(duration_ns) / static_cast<double>(rt::kNsPerSecond);
    mean_s_ += (duration_s - mean_s_) / (mean_s_ == 0 ? 1 : kWeight);
  }
  double mean_s() const { return mean_s_; }

 private:
  double mean_s_ = 0;
};

/// State of FalconWorker from the first exchange until the device is lost.
struct Session {
  Session(FtdiPort& port, HandleChannels& channels, double force_share)
      : link(port), tracker(force_share), commands(channels.command), states(channels.state) {}

  const rt::HandleCommand& newestCommand() {
    commands.refresh();
    return commands.front();
  }

  FalconLink link;
  FalconTracker tracker;
  rt::HandleCommandChannel& commands;
  rt::HandleStateChannel& states;
  ExchangeTime exchange_time;
  std::string advice;              // findings from before the first exchange
  std::uint64_t damaged = 0;       // damaged replies of the link already counted
  std::uint64_t without_pose = 0;  // since the last report
  bool force_cut = false;          // since the last report
};

std::string identityOf(const std::string& serial) {
  return serial.empty() ? "falcon" : "falcon " + serial;
}

/// Driver of a Novint Falcon through libusb. The origin of its frame is kFalconCentre_m; its axes are the
/// device's.
///
/// It loads the device's firmware if it has none, asks the person to home it, and then exchanges an order for
/// a reply about 1000 times a second. Forces are zero while the encoders are not homed, while the position is
/// unknown, and while CommandGate lets no command pass. A device that sends no complete reply for
/// kSilenceLimit is lost.
class FalconWorker final : public HandleWorker {
 public:
  FalconWorker(const config::HandleSettings& settings, const rt::HandleScaleParameters& scale,
               HandleChannels* channels)
      : HandleWorker(identityOf(settings.serial), "looking for the Falcon", kRetryPeriod),
        settings_(settings),
        frame_(settings, scale),
        channels_(channels) {}

  HandleStatus status() const override {
    HandleStatus status = HandleWorker::status();
    status.last_hop = gate_.lastHop();
    return status;
  }

 private:
  base::Result<void> useDevice() override {
    auto port = FtdiPort::open(settings_.serial);
    if (!port) return std::unexpected(port.error());
    board_.update([&](HandleStatus& status) { status.identity = identityOf((*port)->serial()); });

    auto advice = ensureFirmware(**port);
    if (!advice) return std::unexpected(advice.error());
    Session session(**port, *channels_, settings_.of<FalconHandleSettings>().force_share);
    session.advice = std::move(*advice);

    base::Result<void> exchanged = exchange(session);
    session.link.send({});  // zero force; a device that is gone exerts none
    report(session);        // with the counts since the last report
    if (!exchanged) board_.update([](HandleStatus& status) { status.advice.clear(); });
    return exchanged;
  }

  /// Loads the firmware if the device has none, as after a power loss; returns advice on its image. The file
  /// is read after the device has been asked, because a disk may stall: asking releases the force that the
  /// device may still hold from before it was lost.
  base::Result<std::string> ensureFirmware(FtdiPort& port) {
    auto answers = falconAnswers(port, stop_signal_);
    if (!answers) return std::unexpected(answers.error());
    const auto image = readFalconImage(settings_.of<FalconHandleSettings>().firmware);
    if (*answers) return image ? "" : "uses the firmware it already has, but " + image.error().text();
    if (!image) return std::unexpected(image.error());
    base::Error error{"falcon firmware", "stopped", ""};
    std::string failure;
    for (int load = 1; load <= kMaxLoads && !stop_signal_.raised(); ++load) {
      board_.set(HandlePresence::calibrating,
                 fmt::format("loading the firmware, try {} of {}{}", load, kMaxLoads, failure));
      const base::Result<void> loaded = loadFalconImage(port, *image, stop_signal_);
      answers = loaded ? falconAnswers(port, stop_signal_) : std::unexpected(loaded.error());
      if (answers && *answers) return "";
      error = answers ? base::Error{"falcon firmware", "it was loaded but does not respond",
                                    "check that falcon_handle.firmware is an image for the Falcon"}
                      : answers.error();
      failure = "; previous try: " + error.text();
    }
    return std::unexpected(error);
  }

  base::Result<void> exchange(Session& session) {
    if (auto begun = session.link.begin(); !begun) return begun;
    frame_.beginSession();
    seen_ = true;
    report(session);
    Clock::time_point last_reply = Clock::now();
    Clock::time_point last_report = last_reply;
    while (!stop_signal_.raised()) {
      const std::int64_t begin_ns = rt::monotonicNow_ns();
      auto force_n = gate_.pass(session.newestCommand(), frame_.session(), begin_ns);
      if (force_n) force_n = frame_.forceInHandle(*force_n);
      if (auto sent = session.link.send(session.tracker.orderFor(force_n)); !sent) return sent;
      gate_.sent(rt::monotonicNow_ns());
      const auto reply = session.link.receive();
      if (!reply) return std::unexpected(reply.error());
      const Clock::time_point now = Clock::now();
      if (*reply) {
        last_reply = now;
        session.exchange_time.add(rt::monotonicNow_ns() - begin_ns);
        take(session, **reply);
      } else if (now - last_reply > kSilenceLimit) {
        return std::unexpected(
            base::Error{"falcon", "it has stopped responding", "check its USB cable and its power supply"});
      }
      if (now - last_report < kReportPeriod) continue;
      last_report = now;
      report(session);
    }
    return {};
  }

  /// Processes a reply. It reports the position at the begin of the exchange; the command that responds to it
  /// is sent at the begin of the next exchange and takes effect when it has arrived, so the delay is at most
  /// two exchanges.
  void take(Session& session, const FalconReply& reply) {
    FalconTracker& tracker = session.tracker;
    const bool was_homed = tracker.homed();
    tracker.take(reply);
    session.force_cut |= tracker.forceCut();
    if (tracker.homed() != was_homed) {
      frame_.beginSession();  // positions from before the session are unrelated to new ones
      report(session);
    }
    HandleMeasurement measurement;
    measurement.time_ns = rt::monotonicNow_ns();
    measurement.buttons = reply.buttons;
    measurement.calibrated = tracker.homed();
    measurement.delay_s = 2 * session.exchange_time.mean_s();
    measurement.command_latency_ns = gate_.latency_ns();
    measurement.over_link = true;
    if (tracker.homed()) {
      if (!tracker.pose()) {
        ++session.without_pose;
        ++rejected_;
        return;
      }
      measurement.position_m_in_handle = tracker.pose()->position_m - kFalconCentre_m;
    }
    session.states.write(frame_.stateOf(measurement));
    ++measurements_;
  }

  void report(Session& session) {
    rejected_ += session.link.damaged() - session.damaged;
    session.damaged = session.link.damaged();
    const bool homed = session.tracker.homed();
    std::string advice = session.advice;
    if (session.without_pose > 0) {
      advice = fmt::format("its encoders report a position out of its reach (switch it off and on, then {})",
                           kHomingAdvice);
    } else if (session.force_cut) {
      advice = "its motors are at their limit, forces are weaker than commanded";
    }
    board_.update([&](HandleStatus& status) {
      status.state = homed ? HandlePresence::present : HandlePresence::calibrating;
      status.detail = homed ? "" : kHomingAdvice;
      status.measurements = measurements_;
      status.rejected = rejected_;
      status.advice = std::move(advice);
    });
    session.without_pose = 0;
    session.force_cut = false;
  }

  const config::HandleSettings settings_;
  HandleFrame frame_;
  HandleChannels* const channels_;
  CommandGate gate_;
  std::uint64_t measurements_ = 0;
  std::uint64_t rejected_ = 0;
};

}  // namespace

std::unique_ptr<Handle> makeFalconHandle(const config::HandleSettings& settings,
                                         const rt::HandleScaleParameters& scale,
                                         const HandleThreadPolicy& policy) {
  WorkerHandle::Kind kind{
      .name = "falcon", .identity = identityOf(settings.serial), .make = [=](HandleChannels* channels) {
        return std::make_shared<FalconWorker>(settings, scale, channels);
      }};
  return std::make_unique<WorkerHandle>(std::move(kind), policy);
}

}  // namespace hapticd::drivers
