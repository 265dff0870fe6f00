// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/recorded/recorded_session.h"

#include <fmt/format.h>

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

/// Empty lists where this version cannot read the text.
Json entriesOf(const std::string& text) {
  Json entries = {{"fixtures", Json::array()}, {"regions", Json::array()}};
  const auto additions = config::additionsFromText(text, "trace");
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

/// The number of items whose time is not after `time_ns`; `timeOf(item)`: ascending.
template <typename Item, typename TimeOf>
std::size_t countUntil(const std::vector<Item>& items, std::int64_t time_ns, TimeOf timeOf) {
  return static_cast<std::size_t>(std::ranges::upper_bound(items, time_ns, {}, timeOf) - items.begin());
}

std::int64_t arrivalOf_ns(const drivers::DepthRecord& record) {
  return record.header.arrival_ns;
}

}  // namespace

/// Takes the records of a trace in the order of their times.
class RecordedSession::Loading {
 public:
  Loading(RecordedSession& session, const std::filesystem::path& trace) : session_(session), trace_(trace) {}

  drivers::TraceVisitor visitor() {
    return {
        .tick = [this](const rt::Tick& tick) { return take(tick); },
        .model = [this](const drivers::ModelRecord& model) { return keep(session_.models_, model); },
        .directive = [this](const drivers::DirectiveRecord& one) { return keep(session_.directives_, one); },
        .additions = [this](const drivers::AdditionsRecord& additions) { return take(additions); },
        .event = [this](const drivers::EventRecord& event) { return keep(session_.events_, event); },
        .depth = [this](const drivers::DepthRecord& depth) { return take(depth); }};
  }

  /// To be called after the last record.
  config::Result<void> finish() {
    if (!taken_) return taken_;
    if (auto mapped = session_.ticks_.map(); !mapped) return mapped;
    if (auto mapped = session_.images_.map(); !mapped) return mapped;
    // records that came late were written behind newer ones
    std::ranges::stable_sort(session_.models_, {}, &drivers::ModelRecord::time_ns);
    std::ranges::stable_sort(session_.directives_, {}, &drivers::DirectiveRecord::time_ns);
    std::ranges::stable_sort(session_.additions_, {}, &Additions::time_ns);
    std::ranges::stable_sort(session_.events_, {}, &drivers::EventRecord::time_ns);
    std::ranges::stable_sort(session_.frames_, {}, [](const Frame& one) { return arrivalOf_ns(one.record); });
    for (const TraceSetting& setting : settingsIn(settingsText(session_.info_)))
      session_.configured_[setting.name] = setting.text ? Json(setting.value) : valueOf(setting.value);
    return {};
  }

 private:
  template <typename Record>
  static bool keep(std::vector<Record>& records, const Record& record) {
    records.push_back(record);
    return true;
  }

  bool take(const rt::Tick& tick) {
    constexpr std::int64_t kLatest_ns = std::int64_t{1} << 62;  // a clock does not reach it in 146 years
    if (tick.planned_ns < last_tick_ns_ || tick.planned_ns > kLatest_ns) {
      taken_ = std::unexpected(
          config::Error{trace_.string(),
                        fmt::format("tick {} has a time that is impossible after {} ns: {} ns", tick.number,
                                    last_tick_ns_, tick.planned_ns),
                        "show another trace; hapticctl trace export reads this one"});
      return false;
    }
    last_tick_ns_ = tick.planned_ns;
    taken_ = session_.ticks_.append(std::as_bytes(std::span(&tick, 1)));
    return taken_.has_value();
  }

  bool take(const drivers::AdditionsRecord& additions) {
    return keep(session_.additions_, {additions.time_ns, additions.text});
  }

  bool take(const drivers::DepthRecord& depth) {
    Frame frame{depth, session_.images_.size(), depth.image.bytes.size()};
    taken_ = session_.images_.append(std::as_bytes(std::span(depth.image.bytes)));
    frame.record.image = {};
    session_.frames_.push_back(std::move(frame));
    return taken_.has_value();
  }

  RecordedSession& session_;
  const std::filesystem::path& trace_;
  std::int64_t last_tick_ns_ = 0;
  config::Result<void> taken_;
};

config::Result<RecordedSession> RecordedSession::load(const std::filesystem::path& trace) {
  auto ticks = SpillFile::create();
  if (!ticks) return std::unexpected(ticks.error());
  auto images = SpillFile::create();
  if (!images) return std::unexpected(images.error());
  RecordedSession session(std::move(*ticks), std::move(*images));
  session.name_ = trace.stem().string();
  Loading loading(session, trace);
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
  // an event may have any time
  return (static_cast<double>(time_ns) - static_cast<double>(begin_ns())) /
         static_cast<double>(rt::kNsPerSecond);
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
  const std::size_t arrived =
      countUntil(frames_, time_ns, [](const Frame& one) { return arrivalOf_ns(one.record); });
  return arrived == 0 ? std::nullopt : std::optional(arrived - 1);
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
  const std::size_t built = countUntil(models_, time_ns, &drivers::ModelRecord::time_ns);
  return built == 0 ? nullptr : &models_[built - 1];
}

std::size_t RecordedSession::additionsAt(std::int64_t time_ns) const {
  return countUntil(additions_, time_ns, &Additions::time_ns);
}

Json RecordedSession::additions(std::size_t number) const {
  return entriesOf(number == 0 ? "" : additions_[number - 1].text);
}

std::size_t RecordedSession::parameterSetAt(std::int64_t time_ns) const {
  return countUntil(directives_, time_ns, &drivers::DirectiveRecord::time_ns);
}

/// A directive holds the live parameters only: the others are those of the configuration throughout.
Json RecordedSession::parameters(std::size_t set) const {
  Json values = configured_;
  if (set == 0) return values;
  for (const auto& [name, value] : directives_[set - 1].parameters) values[name] = valueOf(value);
  return values;
}

}  // namespace hapticd::tools::view
