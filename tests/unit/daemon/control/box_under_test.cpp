// SPDX-License-Identifier: Apache-2.0
#include "box_under_test.h"

#include <gtest/gtest.h>

#include "drivers/camera/synthetic/analytic_scene.h"
#include "drivers/handle/simulated/simulated_hand.h"
#include "tests/support/program.h"

namespace hapticd::daemon::test {
namespace {

config::Settings settingsOf(const std::filesystem::path& state_folder) {
  config::Settings settings;
  settings.state.folder = state_folder;
  settings.live.force.law = rt::ForceLaw::nearest_springs;
  settings.camera.driver = "synthetic";
  settings.camera.of<drivers::SyntheticSettings>().scene = drivers::SyntheticScene::plane;
  settings.camera.of<drivers::SyntheticSettings>().noise = drivers::SyntheticNoise::off;
  settings.handle.of<drivers::SimulatedHandleSettings>().start_m_in_world = {0, 0, -0.5};
  settings.handle.of<drivers::SimulatedHandleSettings>().travel_m = 0.01;
  settings.handle.of<drivers::SimulatedHandleSettings>().stroke_m = 0;
  return settings;
}

}  // namespace

BoxUnderTest::BoxUnderTest(const std::filesystem::path& state_folder)
    : box_(std::make_unique<RunningBox>(settingsOf(state_folder))) {}

void BoxUnderTest::setSettings(const config::Settings& settings) {
  const std::lock_guard lock(mutex_);
  box_ = std::make_unique<RunningBox>(settings);
}

void BoxUnderTest::start() {
  const auto started = box_->start();
  ASSERT_TRUE(started) << started.error().error.text();
  const bool sees = settings().camera.driver == "synthetic";
  EXPECT_TRUE(hapticd::test::becomesTrue([&] {
    periodic();
    const std::lock_guard lock(mutex_);
    const rt::Tick tick = box_->status().loop.state.tick;
    return tick.mode == rt::Mode::idle && (tick.scene_frame > 0 || !sees);
  }));
}

void BoxUnderTest::periodic() {
  const std::lock_guard lock(mutex_);
  box_->drainTicks({});
}

template <typename Condition>
bool BoxUnderTest::waitUntil(Condition condition) const {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, hapticd::test::maxPatience(), condition);
}

std::uint64_t BoxUnderTest::counted(std::uint64_t generation) {
  ++changes_;
  notify();
  return generation;
}

// --- what the control API calls

BoxStatus BoxUnderTest::status() {
  const std::lock_guard lock(mutex_);
  ++status_calls_;
  notify();
  BoxStatus status = box_->status();
  if (amend_) amend_(status);
  return status;
}

std::uint64_t BoxUnderTest::apply(const config::Settings& settings) {
  const std::lock_guard lock(mutex_);
  return counted(box_->apply(settings));
}

AdditionGenerations BoxUnderTest::additionGenerations() const {
  const std::lock_guard lock(mutex_);
  return box_->additionGenerations();
}

std::uint64_t BoxUnderTest::applyAdditions(const config::SceneAdditions& additions) {
  const std::lock_guard lock(mutex_);
  return counted(box_->applyAdditions(additions));
}

void BoxUnderTest::setMeasuredStiffness(const std::vector<MeasuredStiffness>& measured) {
  const std::lock_guard lock(mutex_);
  box_->setMeasuredStiffness(measured);
}

std::optional<std::size_t> BoxUnderTest::regionAt(const rt::Vec3& position_m_in_world) const {
  const std::lock_guard lock(mutex_);
  return box_->regionAt(position_m_in_world);
}

bool BoxUnderTest::feedPose(const rt::FramePose& pose) {
  const std::lock_guard lock(mutex_);
  return box_->feedPose(pose);
}

bool BoxUnderTest::feedForce(const rt::ExternalForce& force) {
  const std::lock_guard lock(mutex_);
  return box_->feedForce(force);
}

void BoxUnderTest::moveHand(const rt::Vec3& target_m_in_world) {
  const std::lock_guard lock(mutex_);
  box_->moveHand(target_m_in_world);
}

std::uint64_t BoxUnderTest::engage(bool engaged, bool inside) {
  const std::lock_guard lock(mutex_);
  return counted(box_->engage(engaged, inside));
}

bool BoxUnderTest::engaged() {
  const std::lock_guard lock(mutex_);
  return box_->engaged();
}

std::uint64_t BoxUnderTest::acknowledgedGeneration() {
  const std::lock_guard lock(mutex_);
  return held_.value_or(box_->acknowledgedGeneration());
}

template <typename T>
std::future<T> BoxUnderTest::begin(std::function<std::future<T>()> job) {
  const std::lock_guard lock(mutex_);
  ++jobs_requested_;
  notify();
  if (!jobs_held_) return job();
  auto task = std::make_shared<std::packaged_task<T()>>([job = std::move(job)] { return job().get(); });
  jobs_.emplace_back([task] { (*task)(); });
  return task->get_future();
}

std::future<base::Result<std::string>> BoxUnderTest::startTrace(const TraceRequest& request) {
  return begin<base::Result<std::string>>([this, request] { return box_->startTrace(request); });
}

std::future<base::Result<std::string>> BoxUnderTest::stopTrace() {
  return begin<base::Result<std::string>>([this] { return box_->stopTrace(); });
}

std::future<base::Result<std::string>> BoxUnderTest::dumpTrace() {
  return begin<base::Result<std::string>>([this] { return box_->dumpTrace(); });
}

std::future<base::Result<std::vector<trace::TraceEntry>>> BoxUnderTest::listTraces() {
  return begin<base::Result<std::vector<trace::TraceEntry>>>([this] { return box_->listTraces(); });
}

std::future<base::Result<void>> BoxUnderTest::deleteTrace(const std::string& name) {
  return begin<base::Result<void>>([this, name] { return box_->deleteTrace(name); });
}

std::future<base::Result<void>> BoxUnderTest::keepTrace(const std::string& name, bool keep) {
  return begin<base::Result<void>>([this, name, keep] { return box_->keepTrace(name, keep); });
}

std::future<base::Result<void>> BoxUnderTest::noteTrace(const std::string& name, const std::string& text) {
  return begin<base::Result<void>>([this, name, text] { return box_->noteTrace(name, text); });
}

std::future<base::Result<SceneSnapshot>> BoxUnderTest::takeSnapshot() {
  return begin<base::Result<SceneSnapshot>>([this] { return box_->takeSnapshot(); });
}

base::Result<SharedDepth> BoxUnderTest::shareDepth() {
  const std::lock_guard lock(mutex_);
  if (no_memory_) return std::unexpected(base::Error{"depth region", "no memory", "free some"});
  shares_depth_ = true;
  ++times_shared_;
  return box_->shareDepth();
}

void BoxUnderTest::hideDepth() {
  const std::lock_guard lock(mutex_);
  shares_depth_ = false;
  box_->hideDepth();
  notify();
}

// --- what tests call

void BoxUnderTest::holdAcknowledgements() {
  const std::lock_guard lock(mutex_);
  held_ = box_->acknowledgedGeneration();
}

void BoxUnderTest::acknowledge() {
  const std::lock_guard lock(mutex_);
  held_.reset();
}

std::uint64_t BoxUnderTest::changes() const {
  const std::lock_guard lock(mutex_);
  return changes_;
}

bool BoxUnderTest::waitForChanges(std::uint64_t changes) {
  return waitUntil([&] { return changes_ >= changes; });
}

int BoxUnderTest::statusCalls() const {
  const std::lock_guard lock(mutex_);
  return status_calls_;
}

bool BoxUnderTest::waitForStatusCalls(int calls) {
  return waitUntil([&] { return status_calls_ >= calls; });
}

void BoxUnderTest::holdJobs() {
  const std::lock_guard lock(mutex_);
  jobs_held_ = true;
}

void BoxUnderTest::finishJobs() {
  std::vector<std::function<void()>> jobs;
  {
    const std::lock_guard lock(mutex_);
    jobs_held_ = false;
    jobs.swap(jobs_);
  }
  for (const auto& job : jobs) job();
}

int BoxUnderTest::jobs() const {
  const std::lock_guard lock(mutex_);
  return jobs_requested_;
}

bool BoxUnderTest::waitForJobs(int jobs) {
  return waitUntil([&] { return jobs_requested_ >= jobs; });
}

void BoxUnderTest::amendStatus(std::function<void(BoxStatus&)> amend) {
  const std::lock_guard lock(mutex_);
  amend_ = std::move(amend);
}

void BoxUnderTest::setNotices(const std::vector<std::string>& notices) {
  const std::lock_guard lock(mutex_);
  box_->setNotices(notices);
}

void BoxUnderTest::failToShareDepth() {
  const std::lock_guard lock(mutex_);
  no_memory_ = true;
}

bool BoxUnderTest::sharesDepth() const {
  const std::lock_guard lock(mutex_);
  return shares_depth_;
}

int BoxUnderTest::timesDepthWasShared() const {
  const std::lock_guard lock(mutex_);
  return times_shared_;
}

bool BoxUnderTest::waitUntilDepthIsHidden() {
  return waitUntil([this] { return !shares_depth_; });
}

config::Settings BoxUnderTest::appliedSettings() const {
  const std::lock_guard lock(mutex_);
  return box_->settings();
}

}  // namespace hapticd::daemon::test
