// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/box_link/box_source.h"

#include <fmt/format.h>
#include <boost/asio/post.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tools/lib/client/reply_reader.h"
#include "tools/lib/client/tick_batch.h"

namespace hapticd::tools::view {
namespace {

/// A daemon that does not answer for so long hangs; the replies of streams come several times a second.
constexpr std::chrono::seconds kSilence{3};

}  // namespace

AdditionsFetch::AdditionsFetch(boost::asio::io_context& context, std::string socket, OnChange on_change)
    : context_(context), pause_(context), socket_(std::move(socket)), on_change_(std::move(on_change)) {}

void AdditionsFetch::forget() {
  pause_.cancel();
  pausing_ = false;
  for (List* const list : {&fixtures_, &regions_}) {
    if (list->call) list->call->stop();
    *list = {list->method, list->member};
  }
}

void AdditionsFetch::onTick(const rt::Tick& tick) {
  fixtures_.current = tick.fixture_generation;
  regions_.current = tick.tissue_generation;
  fetchWhatChanged();
}

void AdditionsFetch::fetchWhatChanged() {
  const bool changed = fixtures_.current != fixtures_.known || regions_.current != regions_.known;
  if (!changed || pausing_ || fixtures_.call || regions_.call) return;
  for (List* const list : {&fixtures_, &regions_}) {
    if (list->current != list->known) fetch(*list);
  }
  pausing_ = true;
  pause_.expires_after(kPause);
  pause_.async_wait([this](const boost::system::error_code& cancelled) {
    if (!cancelled) pausing_ = false;  // the next tick asks again where that is needed
  });
}

void AdditionsFetch::fetch(List& list) {
  list.call = std::make_shared<VarlinkStream>(context_, kSilence);
  const auto on_reply = [this, &list](const Json& reply, const base::Descriptor&) { take(list, reply); };
  const auto on_end = [&list](const ClientError&) { list.call.reset(); };
  list.call->start(socket_, list.method, Json::object(), /*more=*/false, {on_reply, on_end});
}

void AdditionsFetch::take(List& list, const Json& reply) {
  // the list may be newer than the tick: then the next ticks are of that generation too
  const Json* const generation = fieldAt(reply, "generation");
  if (generation == nullptr || !generation->is_number_unsigned()) return;
  list.known = generation->get<std::uint64_t>();
  list.entries = listAt(reply, list.member);
  on_change_({{"generation", fixtures_.known},
              {fixtures_.member, fixtures_.entries},
              {regions_.member, regions_.entries}});
}

namespace {

/// So long the end of the thread may take, in which other clients wait.
constexpr std::chrono::milliseconds kMaxWait{50};

}  // namespace

DepthFrames::DepthFrames(boost::asio::io_context& context, drivers::DepthRegionReader region, Take take,
                         std::function<void()> closed)
    : shared_(std::make_shared<Shared>()), region_(std::move(region)) {
  shared_->take = std::move(take);
  shared_->closed = std::move(closed);
  thread_ = std::thread([this, &context] { run(context, region_, shared_); });
}

DepthFrames::~DepthFrames() {
  shared_->stopped = true;
  thread_.join();
}

/// Whether there is a new frame that the other thread does not know of yet.
bool DepthFrames::readNewest(const drivers::DepthRegionReader& region,
                             const std::shared_ptr<Shared>& shared) {
  auto picture = std::make_shared<DepthPicture>();
  if (!region.read(picture->header, picture->image)) return false;
  // the memory is written by another process
  const bool good = rt::faultOf(picture->header) == rt::DepthHeaderFault::none &&
                    picture->image.size() == picture->header.imageBytes();
  if (!good) return false;
  const std::lock_guard lock(shared->mutex);
  return std::exchange(shared->newest, std::move(picture)) == nullptr;
}

void DepthFrames::run(boost::asio::io_context& context, const drivers::DepthRegionReader& region,
                      const std::shared_ptr<Shared>& shared) {
  // a frame that was published before is shown at once
  std::uint32_t seen = region.changes() - 1;
  while (!shared->stopped && !region.closed()) {
    if (!region.wait(seen, kMaxWait)) continue;
    seen = region.changes();
    if (!readNewest(region, shared)) continue;
    boost::asio::post(context, [shared] {
      std::shared_ptr<const DepthPicture> newest;
      {
        const std::lock_guard lock(shared->mutex);
        newest = std::exchange(shared->newest, nullptr);
      }
      if (!shared->stopped && newest) shared->take(std::move(newest));
    });
  }
  if (shared->stopped) return;
  boost::asio::post(context, [shared] {
    if (!shared->stopped) shared->closed();
  });
}

namespace {

using namespace std::chrono_literals;

constexpr int kTickIntervalMs = 16;
constexpr int kStatusIntervalMs = 200;

/// All of the status but `tick`, which the stream of ticks brings.
Json statusFields() {
  return Json::array({"mode", "cause", "warnings", "version", "kernel", "uptimeS", "loop", "camera", "scene",
                      "handle", "law", "leds", "trace", "control", "fixtures", "frames", "tissue"});
}

/// Why a call was refused, in words for people.
std::string textOf(const ClientError& error) {
  constexpr std::string_view kDenied = "org.varlink.service.PermissionDenied";
  if (error.kind != ClientError::Kind::error_reply)
    return error.remedy.empty() ? error.what : fmt::format("{} ({})", error.what, error.remedy);
  if (error.what == kDenied) {
    return "no permission to see the depth image (only members of the group haptic-view may: start "
           "hapticd-view as hapticd-view.service does, or set control.depth_for_everyone)";
  }
  if (error.what == "io.hapticd.Status.TooManyStreams") {
    return fmt::format("hapticd already feeds {} such clients (close one of them)",
                       countAt(error.parameters, "limit"));
  }
  if (fieldAt(error.parameters, "reason") != nullptr) return textAt(error.parameters, "reason");
  return fmt::format("hapticd refuses with {} (its version may differ from that of hapticd-view)",
                     printable(error.what));
}

bool changesParameters(std::string_view kind) {
  constexpr std::array<std::string_view, 5> kKinds{"parameter", "profile", "reload", "configuration",
                                                   "calibration"};
  return std::ranges::find(kKinds, kind) != kKinds.end();
}

}  // namespace

BoxSource::BoxSource(boost::asio::io_context& context, const std::string& socket, std::string version,
                     const std::string& control_socket, const std::string& hand_socket)
    : context_(context),
      socket_(socket),
      version_(std::move(version)),
      monitor_(context, socket, "io.hapticd.Status.Monitor",
               {{"intervalMs", kStatusIntervalMs}, {"fields", statusFields()}}, kSilence,
               {[this](const Json& reply, const base::Descriptor&) { onStatus(reply); },
                [this](const ClientError& error) { setBox(false, textOf(error)); }}),
      ticks_(context, socket, "io.hapticd.Status.Ticks",
             {{"fields", allTickFields()}, {"intervalMs", kTickIntervalMs}}, kSilence,
             {[this](const Json& reply, const base::Descriptor&) { onTicks(reply); },
              [this](const ClientError& error) {
                ticks_lost_ = 0;
                if (reachable_ == true && error.kind == ClientError::Kind::error_reply)
                  setBox(true, "no forces: " + textOf(error));
              }}),
      events_(context, socket, "io.hapticd.Status.Events", Json::object(), 0s,
              {[this](const Json& reply, const base::Descriptor&) { onEvent(reply); },
               [](const ClientError&) {}}),
      depth_(context, socket, "io.hapticd.Status.ShareDepth", Json::object(), 0s,
             {[this](const Json&, const base::Descriptor& memory) {
                if (memory) onDepthShared(memory);
              },
              [this](const ClientError& error) {
                frames_.reset();
                setDepth(false, textOf(error));
              }}),
      additions_fetch_(context, socket, [this](const Json& additions) { setAdditions(additions); }),
      solid_shapes_(context, socket, [this](const Json& shapes) {
        for (Viewer* viewer : viewers_) viewer->onSolids(shapes);
      }) {
  if (!control_socket.empty()) fixture_changes_.emplace(context, control_socket);
  if (!hand_socket.empty()) hand_moves_.emplace(context, hand_socket);
}

Json BoxSource::hello() const {
  return {{"type", "hello"},
          {"protocol", 1},
          {"version", version_},
          {"addsFixtures", fixture_changes_.has_value()},
          {"movesHand", hand_moves_.has_value()}};
}

void BoxSource::moveHand(Viewer& viewer, const rt::Vec3& target_m_in_world) {
  if (!hand_moves_) return Source::moveHand(viewer, target_m_in_world);
  hand_moves_->request(viewer, target_m_in_world);
}

void BoxSource::changeFixture(Viewer& viewer, const FixtureRequest& request) {
  if (!fixture_changes_) return Source::changeFixture(viewer, request);
  fixture_changes_->request(viewer, request, [&viewer, name = nameIn(request)](const std::string& problem) {
    viewer.onFixtureAnswer(name, problem);
  });
}

void BoxSource::add(Viewer& viewer) {
  viewers_.push_back(&viewer);
  if (reachable_) viewer.onBox(*reachable_, reason_);
  if (depth_available_) viewer.onDepthState(*depth_available_, depth_reason_);
  if (!parameters_.is_null()) viewer.onParameters(parameters_);
  if (!additions_.is_null()) viewer.onAdditions(additions_);
  if (!solid_shapes_.shapes().empty()) viewer.onSolids(solid_shapes_.shapes());
  if (!status_.is_null()) viewer.onStatus(status_);
  past_events_.forEach([&](const Json& event) { viewer.onEvent(event); });
  if (picture_ && viewer.wantsDepth()) viewer.onDepth(picture_);
  monitor_.open();
  events_.open();
  wantsChanged();
}

void BoxSource::remove(Viewer& viewer) {
  std::erase(viewers_, &viewer);
  if (fixture_changes_) fixture_changes_->forget(viewer);
  if (hand_moves_) hand_moves_->forget(viewer);
  wantsChanged();
  if (!viewers_.empty()) return;
  monitor_.close();
  events_.close();
  if (parameters_call_) parameters_call_->stop();
  forget();
}

void BoxSource::wantsChanged() {
  if (std::ranges::any_of(viewers_, &Viewer::wantsTicks)) {
    ticks_.open();
  } else {
    ticks_.close();
    ticks_lost_ = 0;
  }
  if (std::ranges::any_of(viewers_, &Viewer::wantsDepth)) return depth_.open();
  depth_.close();
  frames_.reset();
  picture_.reset();
  depth_available_.reset();
}

/// Nothing of what was known is shown to those who come after a time without anybody.
void BoxSource::forget() {
  reachable_.reset();
  depth_available_.reset();
  status_ = {};
  parameters_ = {};
  additions_ = {};
  additions_fetch_.forget();
  solid_shapes_.forget();
  past_events_.clear();
  picture_.reset();
  parameters_call_.reset();
}

void BoxSource::onStatus(const Json& reply) {
  const Json* status = fieldAt(reply, "status");
  if (status == nullptr) return;
  if (reachable_ != true) {
    setBox(true, "");
    fetchParameters();
  }
  status_ = *status;
  for (Viewer* viewer : viewers_) viewer->onStatus(status_);
}

void BoxSource::onTicks(const Json& reply) {
  if (reachable_ == true) setBox(true, "");
  const double lost = numberAt(reply, "lostCount");
  if (std::isfinite(lost) && lost >= 0 && lost < 1e18) {
    const auto count = static_cast<std::uint64_t>(lost);
    if (count > ticks_lost_) {
      for (Viewer* viewer : viewers_) viewer->onTicksLost(count - ticks_lost_);
    }
    ticks_lost_ = count;
  }
  forEachTick(reply, [this](const rt::Tick& tick) {
    additions_fetch_.onTick(tick);
    for (Viewer* viewer : viewers_) {
      if (viewer->wantsTicks()) viewer->onTick(tick);
    }
  });
  for (Viewer* viewer : viewers_) viewer->onBatchEnd();
}

void BoxSource::onEvent(const Json& reply) {
  const Json* event = fieldAt(reply, "event");
  // a stream that has been called again begins with events that are known already
  if (event == nullptr || past_events_.contains(*event)) return;
  past_events_.add(*event);
  for (Viewer* viewer : viewers_) viewer->onEvent(*event);
  if (reachable_ == true && changesParameters(textAt(*event, "kind"))) fetchParameters();
}

void BoxSource::onDepthShared(const base::Descriptor& memory) {
  auto region = drivers::DepthRegionReader::open(memory);
  if (!region) return setDepth(false, region.error().text());
  const auto take = [this](std::shared_ptr<const DepthPicture> picture) {
    picture_ = std::move(picture);
    for (Viewer* viewer : viewers_) {
      if (viewer->wantsDepth()) viewer->onDepth(picture_);
    }
  };
  const auto closed = [this] {
    frames_.reset();
    setDepth(false, "the camera's frames have changed, or hapticd ends (the view asks again by itself)");
    depth_.callAgain();
  };
  frames_.emplace(context_, std::move(*region), take, closed);
  setDepth(true, "");
}

void BoxSource::setBox(bool reachable, const std::string& reason) {
  if (reachable_ == reachable && reason_ == reason) return;
  reachable_ = reachable;
  reason_ = reason;
  if (!reachable && fixture_changes_) fixture_changes_->forgetAll();
  for (Viewer* viewer : viewers_) viewer->onBox(reachable, reason);
}

void BoxSource::setDepth(bool available, const std::string& reason) {
  if (depth_available_ == available && depth_reason_ == reason) return;
  depth_available_ = available;
  depth_reason_ = reason;
  if (!available) picture_.reset();
  for (Viewer* viewer : viewers_) viewer->onDepthState(available, reason);
}

void BoxSource::setAdditions(const Json& additions) {
  additions_ = additions;
  if (fixture_changes_) fixture_changes_->follow(additions_);
  solid_shapes_.follow(listAt(additions_, "fixtures"));
  for (Viewer* viewer : viewers_) viewer->onAdditions(additions_);
}

void BoxSource::fetchParameters() {
  if (parameters_call_) {
    parameters_changed_ = true;  // by an event of a series: once more when this call is answered
    return;
  }
  parameters_changed_ = false;
  parameters_call_ = std::make_shared<VarlinkStream>(context_, kSilence);
  const auto done = [this] {
    parameters_call_.reset();
    if (parameters_changed_) fetchParameters();
  };
  parameters_call_->start(socket_, "io.hapticd.Status.GetParameters", Json::object(), /*more=*/false,
                          {[this](const Json& reply, const base::Descriptor&) { onParameters(reply); },
                           [done](const ClientError&) { done(); }});
}

void BoxSource::onParameters(const Json& reply) {
  parameters_ = Json::object();
  for (const Json& row : listAt(reply, "parameters")) {
    const Json* name = fieldAt(row, "name");
    const Json* value = fieldAt(row, "value");
    if (name != nullptr && name->is_string() && value != nullptr)
      parameters_[name->get<std::string>()] = *value;
  }
  for (Viewer* viewer : viewers_) viewer->onParameters(parameters_);
}

}  // namespace hapticd::tools::view
