// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/text/breach_text.h"

#include <fmt/format.h>

#include <cmath>

#include "tools/hapticctl/text/printer.h"
#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {
namespace {

/// "-" for what is not known.
std::string withUnit(double value, int digits, const char* unit) {
  return std::isnan(value) ? "-" : fmt::format("{} {}", fixed(value, digits), unit);
}

std::string speedText(double m_per_s) {
  return withUnit(m_per_s * 1e3, 0, "mm/s");
}

std::string placeText(const rt::Vec3& place_m) {
  if (!isFinite(place_m)) return "-";
  return fmt::format("{} {} {}", fixed(place_m.x * 1e3, 1), fixed(place_m.y * 1e3, 1),
                     fixed(place_m.z * 1e3, 1));
}

Json known(double number) {
  return std::isfinite(number) ? Json(number) : Json(nullptr);
}

Json placeJson(const rt::Vec3& place_m) {
  return {{"x", known(place_m.x)}, {"y", known(place_m.y)}, {"z", known(place_m.z)}};
}

}  // namespace

std::string breachText(const trace::BreachReport& report, std::size_t columns) {
  if (report.fixtures.empty()) return "no breach, and no forbidden region that could be breached\n";
  Table fixtures({{"FIXTURE"},
                  {"BREACHES", true},
                  {"TOTAL", true},
                  {"LONGEST", true},
                  {"DEEPEST", true},
                  {"FASTEST ENTRY", true}});
  for (const trace::FixtureBreaches& sum : report.fixtures) {
    const bool any = sum.count > 0;
    fixtures.add({printable(sum.fixture), fmt::format("{}", sum.count),
                  any ? withUnit(sum.total_s, 2, "s") : "-", any ? withUnit(sum.longest_s, 2, "s") : "-",
                  any ? millimetres(sum.deepest_m) : "-", speedText(sum.fastest_entry_m_per_s)});
  }
  std::string text = fixtures.text(columns);
  if (report.breaches.empty()) return text;
  Table list({{"AT", true},
              {"FOR", true},
              {"DEPTH", true},
              {"ENTRY", true},
              {"FORCE", true},
              {"PLACE (mm)"},
              {"FIXTURE"}});
  for (const trace::BreachEntry& entry : report.breaches) {
    list.add({withUnit(entry.time_s, 3, "s"), withUnit(entry.duration_s, 2, "s"), millimetres(entry.depth_m),
              speedText(entry.entry_m_per_s), withUnit(entry.force_n, 2, "N"),
              placeText(entry.entered_m_in_world), printable(entry.fixture)});
  }
  text += "\n" + list.text(columns);
  if (report.lacks_speeds)
    text += "speeds and forces are not known: the trace is of an older version of hapticd\n";
  return text;
}

Json breachJson(const trace::BreachReport& report) {
  Json fixtures = Json::array();
  for (const trace::FixtureBreaches& sum : report.fixtures) {
    fixtures.push_back({{"fixture", sum.fixture},
                        {"count", sum.count},
                        {"totalS", sum.total_s},
                        {"longestS", sum.longest_s},
                        {"deepestM", sum.deepest_m},
                        {"fastestEntryMPerS", known(sum.fastest_entry_m_per_s)},
                        {"largestForceN", known(sum.largest_force_n)}});
  }
  Json breaches = Json::array();
  for (const trace::BreachEntry& entry : report.breaches) {
    breaches.push_back({{"fixture", entry.fixture},
                        {"timeS", known(entry.time_s)},
                        {"durationS", known(entry.duration_s)},
                        {"depthM", known(entry.depth_m)},
                        {"entrySpeedMPerS", known(entry.entry_m_per_s)},
                        {"largestSpeedMPerS", known(entry.speed_m_per_s)},
                        {"largestForceN", known(entry.force_n)},
                        {"enteredMInWorld", placeJson(entry.entered_m_in_world)}});
  }
  return {{"fixtures", std::move(fixtures)}, {"breaches", std::move(breaches)}};
}

}  // namespace hapticd::tools
