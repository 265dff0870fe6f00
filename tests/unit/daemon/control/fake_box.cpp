#include "fake_box.h"

#include <chrono>

namespace hapticd::daemon::test {
namespace {

constexpr std::chrono::seconds kPatience{20};

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
  settings_ = settings;
  return newGeneration();
}

std::uint64_t FakeBox::engage(bool engaged, bool inside) {
  const std::lock_guard lock(mutex_);
  const bool refused = engaged && !inside && status_.loop.tick.points_used > 0;
  status_.loop.tick.mode = engaged && !refused ? rt::Mode::engaged : rt::Mode::idle;
  status_.loop.tick.cause = refused ? rt::Cause::inside_surface : rt::Cause::requested;
  return newGeneration();
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

namespace {

template <typename T>
std::future<config::Result<T>> notYet() {
  std::promise<config::Result<T>> promise;
  promise.set_value(std::unexpected(config::Error{"traces", "are not written yet", ""}));
  return promise.get_future();
}

}  // namespace

std::future<config::Result<std::string>> FakeBox::startTrace(const TraceRequest&) {
  return notYet<std::string>();
}
std::future<config::Result<std::string>> FakeBox::stopTrace() {
  return notYet<std::string>();
}
std::future<config::Result<std::string>> FakeBox::dumpTrace() {
  return notYet<std::string>();
}
std::future<config::Result<std::vector<drivers::TraceEntry>>> FakeBox::listTraces() {
  return notYet<std::vector<drivers::TraceEntry>>();
}
std::future<config::Result<void>> FakeBox::deleteTrace(const std::string&) {
  return notYet<void>();
}
std::future<config::Result<SceneSnapshot>> FakeBox::takeSnapshot() {
  return notYet<SceneSnapshot>();
}

}  // namespace hapticd::daemon::test
