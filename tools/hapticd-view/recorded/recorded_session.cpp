// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/recorded/recorded_session.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>
#include <utility>

#include "config/fixture_settings.h"
#include "drivers/trace/depth_codec.h"
#include "rt/clock.h"
#include "tools/lib/trace/trace_settings.h"

namespace hapticd::tools::view {
namespace {

/// "0.03" as a number, "true" as a truth value, everything else as text.
Json valueOf(const std::string& text) {
  if (text == "true" || text == "false") return text == "true";
  double number = 0;
  const char* const end = text.data() + text.size();
  const auto [parsed_to, error] = std::from_chars(text.data(), end, number);
  if (error == std::errc() && parsed_to == end && std::isfinite(number)) return number;
  return text;
}

/// Empty lists where this version cannot read the record.
Json entriesOf(const drivers::AdditionsRecord& record) {
  Json entries = {{"fixtures", Json::array()}, {"regions", Json::array()}};
  const auto additions = config::additionsFromText(record.text, "trace");
  if (!additions) return entries;
  for (const config::FixtureSettings& fixture : additions->fixtures) {
    entries["fixtures"].push_back({{"name", fixture.name},
                                   {"definition", Json::parse(config::jsonOf(fixture))},
                                   {"enabled", fixture.enabled}});
  }
  for (const config::RegionSettings& region : additions->regions) {
    entries["regions"].push_back(
        {{"name", region.name}, {"definition", Json::parse(config::jsonOf(region))}});
  }
  return entries;
}

/// The last item whose time is not after `time_ns`; `timeOf(item)`: ascending.
template <typename Item, typename TimeOf>
const Item* lastUntil(const std::vector<Item>& items, std::int64_t time_ns, TimeOf timeOf) {
  const auto after = std::ranges::upper_bound(items, time_ns, {}, timeOf);
  return after == items.begin() ? nullptr : &*std::prev(after);
}

}  // namespace

/// Takes the records of a trace in the order of their times.
class RecordedSession::Loading {
 public:
  explicit Loading(RecordedSession& session) : session_(session) {
    session.additions_.push_back({INT64_MIN, entriesOf({})});
  }

  drivers::TraceVisitor visitor() {
    return {.tick = [this](const rt::Tick& tick) { return take(tick); },
            .model = [this](const drivers::ModelRecord& model) { return keep(session_.models_, model); },
            .directive = [this](const drivers::DirectiveRecord& directive) { return take(directive); },
            .additions = [this](const drivers::AdditionsRecord& additions) { return take(additions); },
            .event = [this](const drivers::EventRecord& event) { return keep(session_.events_, event); },
            .depth = [this](const drivers::DepthRecord& depth) { return take(depth); }};
  }

  /// To be called after the last record.
  config::Result<void> finish() {
    if (!spilled_) return spilled_;
    if (auto mapped = session_.ticks_.map(); !mapped) return mapped;
    if (auto mapped = session_.images_.map(); !mapped) return mapped;
    completeParameters();
    return {};
  }

 private:
  template <typename Record>
  static bool keep(std::vector<Record>& records, const Record& record) {
    records.push_back(record);
    return true;
  }

  bool take(const rt::Tick& tick) {
    spilled_ = session_.ticks_.append(std::as_bytes(std::span(&tick, 1)));
    return spilled_.has_value();
  }

  bool take(const drivers::DirectiveRecord& directive) {
    Json values = Json::object();
    for (const auto& [name, value] : directive.parameters) values[name] = valueOf(value);
    return keep(session_.parameters_, {directive.time_ns, std::move(values)});
  }

  bool take(const drivers::AdditionsRecord& additions) {
    return keep(session_.additions_, {additions.time_ns, entriesOf(additions)});
  }

  bool take(const drivers::DepthRecord& depth) {
    Frame frame{depth, session_.images_.size(), depth.image.bytes.size()};
    spilled_ = session_.images_.append(std::as_bytes(std::span(depth.image.bytes)));
    frame.record.image = {};
    session_.frames_.push_back(std::move(frame));
    return spilled_.has_value();
  }

  /// A directive holds the live parameters only: the others are those of the configuration throughout.
  void completeParameters() {
    Json values = Json::object();
    for (const TraceSetting& setting : settingsIn(settingsText(session_.info_)))
      values[setting.name] = setting.text ? Json(setting.value) : valueOf(setting.value);
    session_.parameters_.insert(session_.parameters_.begin(), ParameterSet{INT64_MIN, values});
    for (ParameterSet& set : session_.parameters_) {
      Json all = values;
      all.update(set.values);
      set.values = std::move(all);
    }
  }

  RecordedSession& session_;
  config::Result<void> spilled_;
};

config::Result<RecordedSession> RecordedSession::load(const std::filesystem::path& trace) {
  auto ticks = SpillFile::create();
  if (!ticks) return std::unexpected(ticks.error());
  auto images = SpillFile::create();
  if (!images) return std::unexpected(images.error());
  RecordedSession session(std::move(*ticks), std::move(*images));
  session.name_ = trace.stem().string();
  Loading loading(session);
  auto info = drivers::readTrace(trace, loading.visitor());
  if (!info) return std::unexpected(info.error());
  session.info_ = std::move(*info);
  if (auto finished = loading.finish(); !finished) return std::unexpected(finished.error());
  if (session.ticks().empty()) {
    return std::unexpected(config::Error{trace.string(), "holds no ticks, so that there is nothing to show",
                                         "name another trace"});
  }
  return session;
}

double RecordedSession::seconds(std::int64_t time_ns) const {
  return static_cast<double>(time_ns - begin_ns()) / static_cast<double>(rt::kNsPerSecond);
}

std::int64_t RecordedSession::timeAt(double seconds) const {
  return begin_ns() + static_cast<std::int64_t>(std::clamp(seconds, 0.0, duration_s()) *
                                                static_cast<double>(rt::kNsPerSecond));
}

std::span<const rt::Tick> RecordedSession::ticks() const noexcept {
  const std::span<const std::byte> bytes = ticks_.bytes();
  return {reinterpret_cast<const rt::Tick*>(bytes.data()), bytes.size() / sizeof(rt::Tick)};
}

std::span<const rt::Tick> RecordedSession::ticksWithin(std::int64_t after_ns, std::int64_t until_ns) const {
  const std::span<const rt::Tick> all = ticks();
  const auto begin = std::ranges::upper_bound(all, after_ns, {}, &rt::Tick::planned_ns);
  const auto end = std::ranges::upper_bound(all, std::max(after_ns, until_ns), {}, &rt::Tick::planned_ns);
  return {begin, end};
}

std::optional<std::size_t> RecordedSession::frameAt(std::int64_t time_ns) const {
  const Frame* const frame =
      lastUntil(frames_, time_ns, [](const Frame& one) { return one.record.header.arrival_ns; });
  if (frame == nullptr) return std::nullopt;
  return static_cast<std::size_t>(frame - frames_.data());
}

std::shared_ptr<const DepthPicture> RecordedSession::picture(std::size_t index) const {
  const Frame& frame = frames_[index];
  drivers::DepthRecord record = frame.record;
  const std::span<const std::byte> encoded = images_.bytes().subspan(frame.offset, frame.bytes);
  record.image.bytes.assign(reinterpret_cast<const char*>(encoded.data()), encoded.size());
  std::string image;
  if (!drivers::DepthDecoder().decode(record, image).empty()) return nullptr;
  auto picture = std::make_shared<DepthPicture>();
  picture->header = record.header;
  const auto bytes = std::as_bytes(std::span(image));
  picture->image.assign(bytes.begin(), bytes.end());
  return picture;
}

const drivers::ModelRecord* RecordedSession::modelAt(std::int64_t time_ns) const {
  return lastUntil(models_, time_ns, &drivers::ModelRecord::time_ns);
}

const Json& RecordedSession::additionsAt(std::int64_t time_ns) const {
  return lastUntil(additions_, time_ns, &ParameterSet::time_ns)->values;
}

const Json& RecordedSession::parametersAt(std::int64_t time_ns) const {
  return lastUntil(parameters_, time_ns, &ParameterSet::time_ns)->values;
}

}  // namespace hapticd::tools::view
