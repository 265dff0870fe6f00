// SPDX-License-Identifier: Apache-2.0
#include "daemon/reloader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "config/additions/addition_fields.h"
#include "config/base/counted.h"
#include "config/settings/parameter_table.h"
#include "daemon/control/base/addition_change.h"
#include "daemon/control/base/change_history.h"

namespace hapticd::daemon {
namespace {

using config::Origin;

template <typename T>
bool isOfConfiguration(const T& item) {
  return item.origin.value == Origin::configuration;
}

template <typename T>
auto named(const std::vector<T>& items, const std::string& name) {
  return std::ranges::find(items, name, &T::name);
}

/// The list after a reload. What stays keeps its place, because the last of several regions at a place
/// counts; the configuration's own follow each other as in the file.
template <typename T>
std::vector<T> merged(const std::vector<T>& running, const std::vector<T>& loaded,
                      std::vector<std::string>& hidden) {
  std::vector<T> own;  // of the configuration, in the order of the file
  for (const T& item : loaded) {
    const auto now = named(running, item.name);
    const bool absent = now == running.end();
    if (absent ? isOfConfiguration(item) : isOfConfiguration(*now)) {
      own.push_back(item);
    } else if (!absent && isOfConfiguration(item) && *now != item) {
      hidden.push_back(std::string(typeOf(item).noun) + " " + item.name);
    }
  }
  const auto isPlace = [&](const T& item) {
    return isOfConfiguration(item) && named(own, item.name) != own.end();
  };
  auto places = std::ranges::count_if(running, isPlace);
  std::vector<T> result;
  auto next = own.begin();
  const auto takeAll = [&] { result.insert(result.end(), std::exchange(next, own.end()), own.end()); };
  if (places == 0) takeAll();
  for (const T& item : running) {
    if (!isOfConfiguration(item)) {
      result.push_back(item);
    } else if (isPlace(item)) {
      --places == 0 ? takeAll() : result.push_back(*next++);
    }
  }
  return result;
}

void mergeAdditions(config::SceneAdditions& running, const config::SceneAdditions& loaded,
                    std::vector<std::string>& hidden) {
  config::forEachList([&hidden](auto& own, const auto& other) { own = merged(own, other, hidden); }, running,
                      loaded);
  const bool own = running.label_image_origin.value == Origin::configuration || running.label_image.empty();
  if (own) {
    running.label_image = loaded.label_image;
    running.label_image_origin = loaded.label_image_origin;
  } else if (!loaded.label_image.empty() && loaded.label_image != running.label_image) {
    hidden.emplace_back("label_image");
  }
}

}  // namespace

std::expected<Reload, std::vector<base::Error>> reloaded(const config::Settings& running,
                                                         const config::Settings& loaded) {
  Reload reload{running, {}, {}};
  for (const config::Parameter& parameter : config::allParameters()) {
    const config::Value new_value = parameter.get(loaded);
    if (parameter.get(running) == new_value) continue;
    if (parameter.effect == config::Effect::restart) {
      reload.waiting.push_back(parameter.name);
    } else {
      parameter.set(reload.settings, new_value);
    }
  }
  mergeAdditions(reload.settings.additions, loaded.additions, reload.hidden);
  std::vector<base::Error> errors = config::checkTogether(reload.settings);
  for (const config::AdditionError& error : config::checkTogether(reload.settings.additions))
    errors.push_back(error.error);
  if (!errors.empty()) return std::unexpected(std::move(errors));
  return reload;
}

namespace {

using Priority = JournalEntry::Priority;
using config::EventKind;

std::string joined(const std::vector<config::Loosening>& loosenings) {
  std::vector<std::string> texts;
  for (const config::Loosening& loosening : loosenings) texts.push_back(loosening.text);
  return fmt::format("{}", fmt::join(texts, "; "));
}

bool areConsistent(const config::Settings& settings) {
  return config::checkTogether(settings).empty() && config::checkTogether(settings.additions).empty();
}

}  // namespace

Reloader::Reloader(Box& box, const StartSettings& start, ConfigurationSource source, Report report)
    : box_(box),
      source_(std::move(source)),
      pose_registered_(start.registration.has_value()),
      report_(std::move(report)),
      reader_([source =
                   source_] { return startSettings(source.file, source.overrides, base::FileKind::regular); },
              source_.file.string()),
      notices_(start.notices) {}

std::uint64_t Reloader::request() {
  requested_ = true;
  return begun_ + 1;
}

std::optional<Reloads::Outcome> Reloader::outcome(std::uint64_t number) const {
  if (finished_ < number) return std::nullopt;
  return last_;
}

void Reloader::periodic(Clock::time_point now, const std::function<void()>& on_begin,
                        const std::function<void()>& on_end) {
  if (const auto loaded = reader_.outcome(now)) {
    last_ = *loaded ? apply(**loaded) : refuse(loaded->error());
    finished_ = begun_;
    on_end();
  }
  if (held_) followPending();
  if (reader_.reading() || !requested_.exchange(false)) return;
  ++begun_;
  on_begin();
  reader_.begin(now);
}

/// A registered pose that waits for the next start has a warning of its own, so it is not listed with the
/// lines of the file.
config::Settings Reloader::comparable(const StartSettings& loaded) const {
  config::Settings settings = loaded.settings;
  if (pose_registered_ || loaded.registration) settings.camera.setPose(box_.settings().camera.pose());
  return settings;
}

Reloads::Outcome Reloader::apply(const StartSettings& loaded) {
  auto reload = reloaded(box_.settings(), comparable(loaded));
  if (!reload) return refuse(std::move(reload.error()));
  notices_ = loaded.notices;
  noteWhatIsNotInUse(*reload);
  pending_.reset();
  held_.reset();
  const auto loosenings = config::looseningsOf(box_.settings(), reload->settings);
  if (!box_.engaged() || loosenings.empty()) {
    ReloadReport report = change(*reload, reload->settings);
    logReload(report);
    if (!loosenings.empty()) logLoosening(loosenings);
    reportSummary(loaded.summary);
    return report;
  }
  pending_ = PendingReload{begun_, heldOf(reload->settings)};
  held_ = loaded;
  ReloadReport report = change(*reload, applicable(reload->settings).value_or(box_.settings()));
  logReload(report);
  report_({Priority::warning,
           fmt::format("reload does not loosen while the box is engaged: {} (hapticctl reload --confirm, or "
                       "hapticctl disengage)",
                       joined(pending_->loosenings)),
           EventKind::reload,
           {}});
  reportSummary(loaded.summary);
  return report;
}

std::optional<config::Settings> Reloader::applicable(const config::Settings& target) const {
  config::Settings settings = config::withoutLoosening(box_.settings(), target);
  return areConsistent(settings) ? std::optional(std::move(settings)) : std::nullopt;
}

std::vector<config::Loosening> Reloader::heldOf(const config::Settings& target) const {
  auto held = config::looseningsOf(box_.settings(), target);
  if (!held.empty() && !applicable(target))
    held.push_back({"", "all other changes in the file, which depend on those held back"});
  return held;
}

void Reloader::noteWhatIsNotInUse(const Reload& reload) {
  if (!reload.waiting.empty()) {
    notices_.push_back(fmt::format("{} of {} takes effect at the next start only (systemctl restart hapticd)",
                                   fmt::join(reload.waiting, ", "), source_.file.string()));
  }
  if (!reload.hidden.empty()) {
    notices_.push_back(
        fmt::format("{} of {} is not in use: a client or a profile has given the name to another one (remove "
                    "that or rename one of the two, then hapticctl reload)",
                    fmt::join(reload.hidden, ", "), source_.file.string()));
  }
}

void Reloader::logReload(const ReloadReport& report) const {
  report_({Priority::notice,
           fmt::format("configuration reloaded from {}: {}, {} waiting for the next start",
                       source_.file.string(), base::counted(report.changes.size(), "change(s)"),
                       base::counted(report.waiting.size(), "parameter(s)")),
           EventKind::reload,
           {}});
}

void Reloader::logLoosening(const std::vector<config::Loosening>& loosenings) const {
  report_({Priority::warning, "reload has loosened: " + joined(loosenings), EventKind::reload, {}});
}

ReloadReport Reloader::change(const Reload& reload, const config::Settings& target) {
  const auto parameters = parameterDifferences(box_.settings(), target);
  const auto additions = differencesOf(box_.additions(), target.additions);
  ReloadReport report{box_.apply(target), {}, {reload.waiting.begin(), reload.waiting.end()}, reload.hidden};
  for (const ParameterDifference& difference : parameters) {
    report.changes.push_back(difference.text());
    report_({Priority::notice, "reload " + difference.text(), EventKind::parameter, difference.fields()});
  }
  for (const AdditionDifference& difference : additions) {
    report.changes.push_back(difference.text());
    report_({Priority::notice, "reload " + difference.text(), difference.kind, difference.fields()});
  }
  return report;
}

Reloads::Outcome Reloader::refuse(std::vector<base::Error> errors) {
  for (const base::Error& error : errors) {
    report_({Priority::error, "reload refused: " + error.text(), EventKind::reload, {}});
  }
  notices_ = {fmt::format("the configuration was not reloaded, nothing changed; {}, the first: {}",
                          base::counted(errors.size(), "problem(s)"), errors.front().text())};
  return std::unexpected(std::move(errors));
}

void Reloader::followPending() {
  if (!box_.engaged()) {
    report_({Priority::notice,
             "the box is disengaged: what the reload has held back applies now",
             EventKind::reload,
             {}});
    if (!confirm()) held_.reset();
  } else if (const auto reload = reloaded(box_.settings(), comparable(*held_))) {
    pending_->loosenings = heldOf(reload->settings);
    if (pending_->loosenings.empty()) held_.reset();
  }
  if (!held_) pending_.reset();
}

Reloads::Outcome Reloader::confirm() {
  const auto reload = reloaded(box_.settings(), comparable(*held_));
  if (!reload) return refuse(reload.error());
  logLoosening(config::looseningsOf(box_.settings(), reload->settings));
  ReloadReport report = change(*reload, reload->settings);
  held_.reset();
  pending_.reset();
  return report;
}

std::vector<std::string> Reloader::warnings() const {
  std::vector<std::string> warnings = notices_;
  if (pending_) {
    warnings.push_back(fmt::format(
        "a reload waits for confirmation, because the box is engaged: {} (hapticctl reload --confirm, or "
        "hapticctl disengage)",
        joined(pending_->loosenings)));
  }
  return warnings;
}

void Reloader::reportSummary(const config::SettingsSummary& summary) const {
  report_({Priority::notice,
           fmt::format("configuration {}: {}", source_.file.string(), summary.text()),
           EventKind::configuration,
           {{"PARAMETERS_SET", fmt::to_string(summary.set)},
            {"PARAMETERS_CHANGED", fmt::to_string(summary.differences.size())},
            {"CHANGES", summary.differencesText()}}});
}

}  // namespace hapticd::daemon
