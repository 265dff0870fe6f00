// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/recorded/trace_source.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <variant>

#include "rt/clock.h"
#include "rt/words.h"
#include "tools/hapticd-view/recorded/timeline.h"

namespace hapticd::tools::view {
namespace {

using namespace std::chrono_literals;

/// Between two steps of the playback.
constexpr std::chrono::milliseconds kStep = 16ms;
constexpr std::chrono::milliseconds kStatusInterval = 200ms;
/// Ticks before a moment that a viewer gets when it comes there.
constexpr std::int64_t kMoment_ns = rt::kNsPerSecond / 60;
/// The first depth frame of a recording is expected within this time.
constexpr std::int64_t kFirstFrame_ns = rt::kNsPerSecond / 10;
/// The step of a recording without depth frames.
constexpr double kFrame_s = 1.0 / 30;

template <typename... Functions>
struct Overloaded : Functions... {
  using Functions::operator()...;
};

std::string metadataOf(const drivers::TraceInfo& info, std::string_view key) {
  const auto found = std::ranges::find(info.metadata, key, &drivers::TraceText::value_type::first);
  return found == info.metadata.end() ? "" : found->second;
}

/// CLOCK_REALTIME of a time of the trace; wraps instead of overflowing, whatever the file contains.
std::int64_t realtimeOf_ns(std::int64_t time_ns, std::int64_t realtime_offset_ns) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(time_ns) +
                                   static_cast<std::uint64_t>(realtime_offset_ns));
}

/// As the type Event of io.hapticd.Status. Traces do not hold how grave it was.
Json eventJson(const drivers::EventRecord& event, std::size_t number, std::int64_t realtime_offset_ns) {
  Json fields = Json::object();
  for (const auto& [name, value] : event.fields) fields[name] = value;
  return {{"number", number},
          {"timeNs", realtimeOf_ns(event.time_ns, realtime_offset_ns)},
          {"kind", event.kind},
          {"text", event.text},
          {"priority", event.kind == "warning" ? "warning" : "notice"},
          {"fields", std::move(fields)}};
}

}  // namespace

TraceSource::TraceSource(boost::asio::io_context& context, RecordedSession session, std::string version)
    : timer_(context),
      session_(std::move(session)),
      version_(std::move(version)),
      timeline_(timelineOf(session_)) {}

Json TraceSource::hello() const {
  return {{"type", "hello"},
          {"protocol", 1},
          {"source", "trace"},
          {"version", version_},
          {"trace",
           {{"name", session_.name()},
            {"beginNs", realtimeOf_ns(session_.begin_ns(), session_.info().realtime_offset_ns)},
            {"realtimeOffsetNs", session_.info().realtime_offset_ns},
            {"durationS", session_.duration_s()},
            {"depth", session_.hasDepth()}}}};
}

void TraceSource::add(Viewer& viewer) {
  viewers_.push_back(&viewer);
  viewer.onBox(true, "");
  viewer.onDepthState(
      session_.hasDepth(),
      session_.hasDepth() ? "" : "the trace holds no depth frames (record it with 'trace start --depth')");
  viewer.onTimeline(timeline_);
  showMoment();
}

void TraceSource::remove(Viewer& viewer) {
  std::erase(viewers_, &viewer);
  if (viewers_.empty()) pause();
}

void TraceSource::wantsChanged() {
  frame_.reset();
  showDepth();
}

void TraceSource::control(const PlaybackRequest& request) {
  std::visit(Overloaded{[this](const Play&) { play(); }, [this](const Pause&) { pause(); },
                        [this](const Seek& to) { seek(to.s); }, [this](const Step& by) { step(by.frames); },
                        [this](const Speed& speed) { factor_ = speed.factor; }},
             request);
  showPlayback();
}

void TraceSource::play() {
  if (playing_) return;
  if (position_s_ >= session_.duration_s()) seek(0);
  playing_ = true;
  shown_at_ = Clock::now();
  schedule();
}

void TraceSource::pause() {
  playing_ = false;
  timer_.cancel();
}

void TraceSource::seek(double position_s) {
  position_s_ = std::clamp(position_s, 0.0, session_.duration_s());
  showMoment();
}

void TraceSource::step(int frames) {
  pause();
  if (!session_.hasDepth()) return seek(position_s_ + frames * kFrame_s);
  // before the first frame counts as the one before it
  const auto now = frameNow();
  const std::ptrdiff_t target = (now ? static_cast<std::ptrdiff_t>(*now) : -1) + frames;
  const auto last = static_cast<std::ptrdiff_t>(session_.frameCount()) - 1;
  const auto frame = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(target, 0, last));
  seek(session_.seconds(session_.frameTime_ns(frame)));
}

void TraceSource::schedule() {
  timer_.expires_after(kStep);
  timer_.async_wait([this](const boost::system::error_code& error) {
    if (error || !playing_) return;
    advance();
    if (playing_) schedule();
  });
}

void TraceSource::advance() {
  const Clock::time_point now = Clock::now();
  const std::int64_t before_ns = position_ns();
  position_s_ += factor_ * std::chrono::duration<double>(now - shown_at_).count();
  shown_at_ = now;
  if (position_s_ >= session_.duration_s()) {
    position_s_ = session_.duration_s();
    playing_ = false;
  }
  showTicks(session_.ticksWithin(before_ns, position_ns()));
  showDepth();
  showParameters();
  showAdditions();
  const auto events = session_.events();
  for (; next_event_ < events.size() && events[next_event_].time_ns <= position_ns(); ++next_event_) {
    const Json event = eventJson(events[next_event_], next_event_ + 1, session_.info().realtime_offset_ns);
    for (Viewer* viewer : viewers_) viewer->onEvent(event);
  }
  if (now < next_status_ && playing_) return;
  next_status_ = now + kStatusInterval;
  showStatus();
  showPlayback();
}

void TraceSource::showMoment() {
  const auto events = session_.events();
  const auto after = std::ranges::upper_bound(events, position_ns(), {}, &drivers::EventRecord::time_ns);
  next_event_ = static_cast<std::size_t>(after - events.begin());
  frame_.reset();
  parameters_.reset();
  additions_.reset();
  showParameters();
  showAdditions();
  showStatus();
  showTicks(session_.ticksWithin(position_ns() - kMoment_ns, position_ns()));
  showDepth();
  showPlayback();
}

void TraceSource::showTicks(std::span<const rt::Tick> ticks) {
  for (Viewer* viewer : viewers_) {
    if (!viewer->wantsTicks()) continue;
    for (const rt::Tick& tick : ticks) viewer->onTick(tick);
    viewer->onBatchEnd();
  }
}

/// The depth frame of the position; before the first one arrives that one, unless it takes long.
std::optional<std::size_t> TraceSource::frameNow() const {
  const auto frame = session_.frameAt(position_ns());
  if (frame || !session_.hasDepth()) return frame;
  if (session_.frameTime_ns(0) > session_.begin_ns() + kFirstFrame_ns) return std::nullopt;
  return 0;
}

void TraceSource::showDepth() {
  const auto frame = frameNow();
  if (!frame || frame == frame_ || std::ranges::none_of(viewers_, &Viewer::wantsDepth)) return;
  frame_ = frame;
  const auto picture = session_.picture(*frame);
  if (!picture) return;
  for (Viewer* viewer : viewers_) {
    if (viewer->wantsDepth()) viewer->onDepth(picture);
  }
}

void TraceSource::showStatus() {
  const Json now = status();
  for (Viewer* viewer : viewers_) viewer->onStatus(now);
}

void TraceSource::showParameters() {
  const std::size_t set = session_.parameterSetAt(position_ns());
  if (parameters_ == set) return;
  parameters_ = set;
  const Json now = session_.parameters(set);
  for (Viewer* viewer : viewers_) viewer->onParameters(now);
}

void TraceSource::showAdditions() {
  const std::size_t number = session_.additionsAt(position_ns());
  if (additions_ == number) return;
  additions_ = number;
  const Json now = session_.additions(number);
  for (Viewer* viewer : viewers_) viewer->onAdditions(now);
}

void TraceSource::showPlayback() {
  const Json now = playback();
  for (Viewer* viewer : viewers_) viewer->onPlayback(now);
}

/// Of the Status object what a trace knows.
Json TraceSource::status() const {
  const auto ticks = session_.ticksWithin(INT64_MIN, position_ns());
  const rt::Tick& tick = ticks.empty() ? session_.ticks().front() : ticks.back();
  const drivers::ModelRecord* const model = session_.modelAt(position_ns());
  const drivers::TraceInfo& info = session_.info();
  Json scene = {{"ballCentreMInWorld", nullptr}, {"ballRadiusM", nullptr}};
  if (model != nullptr && std::isfinite(model->radius_m)) {
    const auto& [x, y, z] = model->centre_m_in_world;
    scene = {{"ballCentreMInWorld", {{"x", x}, {"y", y}, {"z", z}}}, {"ballRadiusM", model->radius_m}};
  }
  if (model != nullptr) scene["frames"] = model->frames;
  return {{"mode", rt::wordOf(tick.mode)},
          {"cause", rt::wordOf(tick.cause)},
          {"warnings", Json::array()},
          {"version", metadataOf(info, "hapticd_version")},
          {"kernel", metadataOf(info, "kernel")},
          {"camera", {{"identity", metadataOf(info, "camera")}}},
          {"handle", {{"identity", metadataOf(info, "handle")}}},
          {"law", {{"chosen", rt::wordOf(tick.law)}, {"reason", "as recorded"}}},
          {"scene", std::move(scene)}};
}

Json TraceSource::playback() const {
  return {{"type", "playback"}, {"s", position_s_}, {"playing", playing_}, {"factor", factor_}};
}

}  // namespace hapticd::tools::view
