// SPDX-License-Identifier: Apache-2.0
#include "fake_box.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <utility>

#include "drivers/camera/kinect_image.h"

namespace hapticd::daemon::test {
namespace {

constexpr std::chrono::seconds kPatience{60};

}  // namespace

FakeBox::FakeBox() {
  status_.camera = {drivers::CameraState::streaming, "", "synthetic sphere", 300, 1};
  status_.handle.state = drivers::HandlePresence::present;
  status_.handle.identity = "simulated";
  status_.loop.tick.mode = rt::Mode::idle;
  status_.loop.tick.cause = rt::Cause::requested;
}

BoxStatus FakeBox::status() {
  const std::lock_guard lock(mutex_);
  ++status_calls_;
  changed_.notify_all();
  BoxStatus status = status_;
  status.uptime_s += status_calls_;
  return status;
}

std::uint64_t FakeBox::apply(const config::Settings& settings) {
  const std::lock_guard lock(mutex_);
  return take(settings);
}

/// Settings and generation change together, for tests that wait for the generation.
std::uint64_t FakeBox::take(const config::Settings& settings) {
  if (settings.additions.fixtures != settings_.additions.fixtures) ++addition_generations_.fixtures;
  if (settings.additions.regions != settings_.additions.regions) ++addition_generations_.regions;
  settings_ = settings;
  return newGeneration();
}

AdditionGenerations FakeBox::additionGenerations() const {
  const std::lock_guard lock(mutex_);
  return addition_generations_;
}

std::uint64_t FakeBox::applyAdditions(const config::SceneAdditions& additions) {
  const std::lock_guard lock(mutex_);
  config::Settings settings = settings_;
  settings.additions = additions;
  return take(settings);
}

void FakeBox::applyStiffness(const std::vector<config::RegionSettings>& regions) {
  const std::lock_guard lock(mutex_);
  settings_.additions.regions = regions;
  ++times_stiffness_applied_;
  changed_.notify_all();
}

/// Knows regions that are spheres in the world frame only.
std::optional<std::size_t> FakeBox::regionAt(const rt::Vec3& position_m_in_world) const {
  const std::lock_guard lock(mutex_);
  const auto& regions = settings_.additions.regions;
  for (std::size_t i = regions.size(); i-- > 0;) {
    if (rt::norm(position_m_in_world - regions[i].position_m) <= regions[i].radius_m) return i;
  }
  return std::nullopt;
}

bool FakeBox::waitForStiffness(int times) {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, kPatience, [&] { return times_stiffness_applied_ >= times; });
}

int FakeBox::timesStiffnessWasApplied() const {
  const std::lock_guard lock(mutex_);
  return times_stiffness_applied_;
}

std::uint64_t FakeBox::engage(bool engaged, bool inside) {
  const std::lock_guard lock(mutex_);
  const bool refused = engaged && !inside && status_.loop.tick.points_used > 0;
  status_.loop.tick.mode = engaged && !refused ? rt::Mode::engaged : rt::Mode::idle;
  status_.loop.tick.cause = refused ? rt::Cause::inside_surface : rt::Cause::requested;
  return newGeneration();
}

bool FakeBox::engaged() {
  const std::lock_guard lock(mutex_);
  return status_.loop.tick.mode == rt::Mode::engaged || status_.loop.tick.mode == rt::Mode::holding;
}

std::uint64_t FakeBox::newGeneration() {
  ++generation_;
  if (!held_) acknowledged_ = generation_;
  changed_.notify_all();
  return generation_;
}

std::uint64_t FakeBox::acknowledgedGeneration() {
  const std::lock_guard lock(mutex_);
  return acknowledged_;
}

void FakeBox::holdAcknowledgements() {
  const std::lock_guard lock(mutex_);
  held_ = true;
}

void FakeBox::acknowledge() {
  const std::lock_guard lock(mutex_);
  acknowledged_ = generation_;
}

bool FakeBox::waitForGeneration(std::uint64_t generation) {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, kPatience, [&] { return generation_ >= generation; });
}

int FakeBox::statusCalls() const {
  const std::lock_guard lock(mutex_);
  return status_calls_;
}

bool FakeBox::waitForStatusCalls(int calls) {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, kPatience, [&] { return status_calls_ >= calls; });
}

void FakeBox::setStatus(const BoxStatus& status) {
  const std::lock_guard lock(mutex_);
  status_ = status;
}

config::Settings FakeBox::appliedSettings() const {
  const std::lock_guard lock(mutex_);
  return settings_;
}

std::uint64_t FakeBox::generation() const {
  const std::lock_guard lock(mutex_);
  return generation_;
}

void FakeBox::holdJobs() {
  const std::lock_guard lock(mutex_);
  jobs_held_ = true;
}

void FakeBox::finishJobs() {
  const std::lock_guard lock(mutex_);
  jobs_held_ = false;
  for (const auto& job : std::exchange(jobs_, {})) job();
}

bool FakeBox::waitForJobs(int jobs, std::chrono::seconds patience) {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, patience, [&] { return jobs_begun_ >= jobs; });
}

void FakeBox::setTraces(int count, const std::string& note) {
  const std::lock_guard lock(mutex_);
  traces_.clear();
  for (int i = 0; i < count; ++i) {
    drivers::TraceEntry& trace = traces_.emplace_back();
    trace.name = "trace-" + std::to_string(i);
    trace.bytes = 1000U + static_cast<unsigned>(i);
    trace.time_ns = 5'000 + i;
    trace.note = note;
  }
}

void FakeBox::setFrame(bool there) {
  const std::lock_guard lock(mutex_);
  frame_there_ = there;
}

template <typename T>
std::future<config::Result<T>> FakeBox::begin(std::function<config::Result<T>()> job) {
  auto task = std::make_shared<std::packaged_task<config::Result<T>()>>(std::move(job));
  const std::lock_guard lock(mutex_);
  ++jobs_begun_;
  changed_.notify_all();
  if (jobs_held_) {
    jobs_.emplace_back([task] { (*task)(); });
  } else {
    (*task)();
  }
  return task->get_future();
}

config::Result<std::string> FakeBox::newTrace(const std::string& label, bool open, bool depth) {
  std::string name = "trace-" + std::to_string(traces_.size());
  if (!label.empty()) name += "-" + label;
  const auto time_ns = 5'000 + static_cast<std::int64_t>(traces_.size());
  drivers::TraceEntry& trace = traces_.emplace_back();
  trace.name = name;
  trace.time_ns = time_ns;
  trace.open = open;
  trace.depth = depth;
  return name;
}

config::Result<std::string> FakeBox::closeTrace() {
  for (drivers::TraceEntry& trace : traces_) {
    if (!trace.open) continue;
    trace.open = false;
    return trace.name;
  }
  return std::unexpected(config::Error{"trace", "none is being written", "start one"});
}

std::future<config::Result<std::string>> FakeBox::startTrace(const TraceRequest& request) {
  return begin<std::string>([this, request]() -> config::Result<std::string> {
    if (std::ranges::any_of(traces_, &drivers::TraceEntry::open)) {
      return std::unexpected(config::Error{"trace", "one is being written", "stop it first"});
    }
    return newTrace(request.label, true, request.depth);
  });
}

std::future<config::Result<std::string>> FakeBox::stopTrace() {
  return begin<std::string>([this] { return closeTrace(); });
}

std::future<config::Result<std::string>> FakeBox::dumpTrace() {
  return begin<std::string>([this] { return newTrace("dump", false, false); });
}

std::future<config::Result<std::vector<drivers::TraceEntry>>> FakeBox::listTraces() {
  return begin<std::vector<drivers::TraceEntry>>([this] { return traces_; });
}

std::future<config::Result<void>> FakeBox::deleteTrace(const std::string& name) {
  return begin<void>([this, name]() -> config::Result<void> {
    if (std::erase_if(traces_, [&](const auto& trace) { return trace.name == name && !trace.open; }) == 1)
      return {};
    return std::unexpected(config::Error{"trace " + name, "there is no such finished trace", "list them"});
  });
}

std::future<config::Result<void>> FakeBox::keepTrace(const std::string& name, bool keep) {
  return begin<void>([this, name, keep]() -> config::Result<void> {
    for (drivers::TraceEntry& trace : traces_) {
      if (trace.name != name) continue;
      trace.kept = keep;
      return {};
    }
    return std::unexpected(config::Error{"trace " + name, "there is no such trace", "list them"});
  });
}

std::future<config::Result<void>> FakeBox::noteTrace(const std::string& name, const std::string& text) {
  return begin<void>([this, name, text]() -> config::Result<void> {
    for (drivers::TraceEntry& trace : traces_) {
      if (trace.name != name) continue;
      trace.note = text;
      return {};
    }
    return std::unexpected(config::Error{"trace " + name, "there is no such trace", "list them"});
  });
}

std::future<config::Result<SceneSnapshot>> FakeBox::takeSnapshot() {
  return begin<SceneSnapshot>([this]() -> config::Result<SceneSnapshot> {
    if (!frame_there_) return std::unexpected(config::Error{"camera", "no frame yet", "connect it"});
    SceneSnapshot snapshot{std::make_unique<rt::DepthFrame>(), {}, settings_.camera.pose, status_.loop.tick};
    for (std::size_t pixel = 0; pixel < drivers::kKinectPixels; ++pixel)
      snapshot.frame->raw[pixel] = rawAt(pixel);
    snapshot.frame->sequence = 77;
    return snapshot;
  });
}

config::Result<SharedDepth> FakeBox::shareDepth() {
  const std::lock_guard lock(mutex_);
  if (no_memory_) return std::unexpected(config::Error{"depth region", "no memory", "free some"});
  auto region = drivers::DepthRegionWriter::create(sizeof(rt::DepthFrame::raw));
  if (!region) return std::unexpected(region.error());
  std::vector<std::uint16_t> raw(drivers::kKinectPixels);
  for (std::size_t pixel = 0; pixel < raw.size(); ++pixel) raw[pixel] = rawAt(pixel);
  rt::DepthFrameHeader header;
  header.width_px = drivers::kKinectWidth;
  header.height_px = drivers::kKinectHeight;
  header.stride_bytes = drivers::kKinectWidth * 2;
  header.frame = 77;
  (*region)->publish(header, std::as_bytes(std::span(raw)));
  depth_region_ = std::move(*region);
  ++times_shared_;
  return SharedDepth{depth_region_->descriptor(), depth_region_->bytes()};
}

void FakeBox::hideDepth() {
  const std::lock_guard lock(mutex_);
  depth_region_.reset();
  changed_.notify_all();
}

void FakeBox::failToShareDepth() {
  const std::lock_guard lock(mutex_);
  no_memory_ = true;
}

bool FakeBox::sharesDepth() const {
  const std::lock_guard lock(mutex_);
  return depth_region_ != nullptr;
}

int FakeBox::timesDepthWasShared() const {
  const std::lock_guard lock(mutex_);
  return times_shared_;
}

bool FakeBox::waitUntilDepthIsHidden() {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, std::chrono::seconds(20), [this] { return depth_region_ == nullptr; });
}

}  // namespace hapticd::daemon::test
