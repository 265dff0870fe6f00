// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/text/open_metrics.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "daemon/status/box_status.h"
#include "rt/base/fields.h"
#include "rt/base/words.h"
#include "rt/laws/law_table.h"

namespace hapticd::tools {
namespace {

constexpr double kPerNanosecond = 1e-9;

constexpr std::string_view kUnits[] = {"bytes",
                                       "celsius",
                                       "hertz",
                                       "joules",
                                       "metres",
                                       "newtons",
                                       "newton_seconds_per_metre",
                                       "newtons_per_metre",
                                       "ratio",
                                       "seconds"};

/// The unit that a name ends with; empty: none.
std::string_view unitOf(std::string_view name) {
  std::string_view unit;
  for (const std::string_view known : kUnits) {
    if (name.ends_with(fmt::format("_{}", known)) && known.size() > unit.size()) unit = known;
  }
  return unit;
}

/// A field of the status that is a metric.
struct MetricField {
  std::string_view name;  ///< without "hapticd_" and "_total"
  rt::MetricKind kind;
  std::string path;  ///< in the status
  std::string_view help;
  double scale;                              ///< from the unit of the status
  std::span<const std::string_view> states;  ///< of an enumeration
};

template <typename Record>
void addFields(std::vector<MetricField>& metrics, const std::string& above) {
  rt::forEachShownField<Record>([&](const auto& field) {
    const std::string path = above + std::string(field.json_name.text());
    using Shown = std::remove_cvref_t<decltype(field.show(std::declval<const Record&>()))>;
    using Value = typename decltype([] {
      if constexpr (requires { typename Shown::value_type; })
        return std::type_identity<typename Shown::value_type>{};
      else
        return std::type_identity<Shown>{};
    }())::type;
    if (!field.metric.empty()) {
      std::span<const std::string_view> states;
      if constexpr (rt::Worded<Value>) states = rt::kWords<Value>;
      metrics.push_back({field.metric, field.metric_kind, path, field.help,
                         field.path.ends_with("_ns") ? kPerNanosecond : 1, states});
    } else if constexpr (rt::Tabled<Value>) {
      if constexpr (!std::is_same_v<Value, daemon::FixtureConduct> &&
                    !std::is_same_v<Value, daemon::FrameStatus>)
        addFields<Value>(metrics, path + ".");
    }
  });
}

/// All fields that are metrics, enumerations first.
const std::vector<MetricField>& metricFields() {
  static const std::vector<MetricField> all = [] {
    std::vector<MetricField> metrics;
    addFields<daemon::BoxStatus>(metrics, "");
    std::ranges::stable_sort(metrics, {},
                             [](const MetricField& field) { return field.kind != rt::MetricKind::states; });
    return metrics;
  }();
  return all;
}

struct Quantile {
  const char* label;
  const char* field;
};
constexpr std::array<Quantile, 4> kQuantiles{
    {{"0.5", "p50Ns"}, {"0.99", "p99Ns"}, {"0.999", "p999Ns"}, {"1", "maxNs"}}};

/// Writes families, each with its head, in one of the two formats.
class MetricsWriter {
 public:
  explicit MetricsWriter(MetricsFormat format) : prometheus_(format == MetricsFormat::prometheus) {}

  /// Begins a family. Prometheus' format names the samples there, and has neither units nor all types.
  void begin(std::string_view name, std::string_view type, std::string_view unit, std::string_view help) {
    sample_ = fmt::format("hapticd_{}{}", name, type == "counter" ? "_total" : type == "info" ? "_info" : "");
    const std::string family = prometheus_ ? sample_ : fmt::format("hapticd_{}", name);
    const bool known = type == "counter" || type == "gauge" || type == "summary";
    text_ += fmt::format("# TYPE {} {}\n", family, known || !prometheus_ ? type : "gauge");
    if (!unit.empty() && !prometheus_) text_ += fmt::format("# UNIT {} {}\n", family, unit);
    text_ += fmt::format("# HELP {} {}\n", family, help);
  }
  void begin(const MetricField& field, std::string_view type) {
    begin(field.name, type, type == "stateset" ? "" : unitOf(field.name), fmt::format("{}.", field.help));
  }
  /// Adds a sample to it. `labels`: none, or with their braces.
  void add(const std::string& labels, double value) {
    text_ += fmt::format("{}{} {}\n", sample_, labels, value);
  }
  std::string text() const { return prometheus_ ? text_ : text_ + "# EOF\n"; }

 private:
  bool prometheus_;
  std::string sample_;
  std::string text_;
};

void addNumber(MetricsWriter& metrics, const MetricField& field, const Json& status) {
  const double value = numberAt(status, field.path);
  if (std::isnan(value)) return;
  metrics.begin(field, field.kind == rt::MetricKind::counter ? "counter" : "gauge");
  metrics.add("", value * field.scale);
}

void addSummary(MetricsWriter& metrics, const MetricField& field, const Json& status) {
  bool begun = false;
  for (const Quantile& quantile : kQuantiles) {
    const double value = numberAt(status, fmt::format("{}.{}", field.path, quantile.field));
    if (std::isnan(value)) continue;
    if (!std::exchange(begun, true)) metrics.begin(field, "summary");
    metrics.add(fmt::format("{{quantile=\"{}\"}}", quantile.label), value * kPerNanosecond);
  }
}

void addStates(MetricsWriter& metrics, const MetricField& field, const Json& status) {
  const std::string now = textAt(status, field.path);
  if (now == "-") return;
  metrics.begin(field, "stateset");
  const auto sample = [&](std::string_view state) {
    metrics.add(fmt::format("{{hapticd_{}=\"{}\"}}", field.name, labelValue(state)), state == now ? 1 : 0);
  };
  for (const std::string_view state : field.states) sample(state);
  // a newer daemon may know more states
  if (std::ranges::find(field.states, std::string_view(now)) == field.states.end()) sample(now);
}

/// The metrics of each fixture: families with a sample for each, labelled with its name.
void addFixtures(MetricsWriter& metrics, const Json& status) {
  static const std::vector<MetricField> fields = [] {
    std::vector<MetricField> all;
    addFields<daemon::FixtureConduct>(all, "");
    return all;
  }();
  for (const MetricField& field : fields) {
    const bool states = field.kind == rt::MetricKind::states;
    const char* const type = states                                  ? "stateset"
                             : field.kind == rt::MetricKind::counter ? "counter"
                                                                     : "gauge";
    bool begun = false;
    for (const Json& conduct : listAt(status, "fixtures.each")) {
      const std::string fixture = fmt::format("fixture=\"{}\"", labelValue(textAt(conduct, "name")));
      const std::string now = textAt(conduct, field.path);
      const double number = numberAt(conduct, field.path);
      if (states ? now == "-" : std::isnan(number)) continue;
      if (!std::exchange(begun, true)) metrics.begin(field, type);
      if (!states) metrics.add(fmt::format("{{{}}}", fixture), number * field.scale);
      for (const std::string_view state : field.states) {
        metrics.add(fmt::format("{{{},hapticd_{}=\"{}\"}}", fixture, field.name, labelValue(state)),
                    state == now ? 1 : 0);
      }
    }
  }
}

void add(MetricsWriter& metrics, const MetricField& field, const Json& status) {
  if (field.kind == rt::MetricKind::states) return addStates(metrics, field, status);
  if (field.kind == rt::MetricKind::summary) return addSummary(metrics, field, status);
  addNumber(metrics, field, status);
}

/// Transitions by cause: a family of several samples.
void addTransitionCauses(MetricsWriter& metrics, const Json& status) {
  const Json* causes = fieldAt(status, "loop.transitions.byCause");
  if (!causes || !causes->is_object() || causes->empty()) return;
  metrics.begin("loop_transitions_by_cause", "counter", "", "Changes of the mode, by their cause.");
  for (const auto& [cause, count] : causes->items()) {
    if (!count.is_number()) continue;
    metrics.add(fmt::format("{{cause=\"{}\"}}", labelValue(cause)), count.get<double>());
  }
}

/// A value of a family whose samples differ in one label.
struct Labelled {
  std::string_view value;
  double number;
};

/// A gauge with a sample for each label whose number is known; left out if none is.
void addLabelled(MetricsWriter& metrics, std::string_view name, std::string_view unit, std::string_view help,
                 std::string_view label, std::span<const Labelled> samples) {
  bool begun = false;
  for (const Labelled& sample : samples) {
    if (std::isnan(sample.number)) continue;
    if (!std::exchange(begun, true)) metrics.begin(name, "gauge", unit, help);
    metrics.add(fmt::format("{{{}=\"{}\"}}", label, sample.value), sample.number);
  }
}

/// The family that identifies the daemon. Its labels change with an update only: a label whose value changed
/// while the daemon runs would begin another time series.
void addInformation(MetricsWriter& metrics, const Json& status) {
  metrics.begin("build", "info", "", "Versions of hapticd and of the kernel.");
  metrics.add(fmt::format("{{version=\"{}\",kernel=\"{}\"}}", labelValue(textAt(status, "version")),
                          labelValue(textAt(status, "kernel"))),
              1);
}

void addCount(MetricsWriter& metrics, std::string_view name, std::string_view help, const Json& status,
              const char* path) {
  if (!fieldAt(status, path)) return;
  metrics.begin(name, "gauge", "", help);
  metrics.add("", static_cast<double>(listAt(status, path).size()));
}

}  // namespace

std::string labelValue(std::string_view text) {
  std::string escaped;
  for (const char character : text) {
    if (character == '\\' || character == '"') escaped += '\\';
    escaped += character == '\n' ? std::string("\\n") : std::string(1, character);
  }
  return escaped;
}

std::string metricsOf(const Json& status, MetricsFormat format) {
  MetricsWriter metrics(format);
  const bool up = status.is_object();
  metrics.begin("up", "gauge", "", "Whether the daemon answers.");
  metrics.add("", up ? 1 : 0);
  if (!up) return metrics.text();
  addInformation(metrics, status);
  addCount(metrics, "warnings", "Warnings of the daemon at this moment.", status, "warnings");
  for (const MetricField& field : metricFields()) add(metrics, field, status);
  addFixtures(metrics, status);
  addTransitionCauses(metrics, status);
  addLabelled(metrics, "tick_force_newtons", "newtons", "Magnitude of the newest force.", "stage",
              std::array{Labelled{"law", lengthAt(status, "tick.lawForceNInWorld")},
                         Labelled{"command", lengthAt(status, "tick.commandForceNInWorld")}});
  addLabelled(metrics, "tick_hip_metres", "metres", "The haptic interaction point in the world.", "axis",
              std::array{Labelled{"x", numberAt(status, "tick.hipMInWorld.x")},
                         Labelled{"y", numberAt(status, "tick.hipMInWorld.y")},
                         Labelled{"z", numberAt(status, "tick.hipMInWorld.z")}});
  addCount(metrics, "fixtures_in_contact",
           "Virtual fixtures that hold the interaction point back or guide it.", status,
           "fixtures.inContact");
  return metrics.text();
}

}  // namespace hapticd::tools
