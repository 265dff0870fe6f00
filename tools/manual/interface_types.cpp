// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <concepts>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "daemon/status/box_status.h"
#include "rt/base/fields.h"
#include "rt/base/words.h"
#include "rt/laws/law_table.h"
#include "tools/manual/generated.h"

namespace hapticd::tools {
namespace {

/// A C++ type and the type of io.hapticd.Status that stands for it.
template <typename Type>
struct Named {
  std::string_view name;
};
constexpr std::tuple kTypes{
    Named<rt::Mode>{"Mode"},
    Named<rt::Cause>{"Cause"},
    Named<rt::Transition>{"Transition"},
    Named<daemon::TransitionsOf>{"Transitions"},
    Named<drivers::CameraState>{"CameraState"},
    Named<drivers::LedState>{"LedState"},
    Named<daemon::LedPattern>{"LedPattern"},
    Named<rt::Vec3>{"Vector"},
    Named<rt::LatencySummary>{"Latency"},
    Named<rt::ForceLaw>{"Law"},
    Named<rt::ContactState>{"Contact"},
    Named<rt::StiffnessRule>{"StiffnessRule"},
    Named<daemon::LawStatus>{"LawInUse"},
    Named<rt::StiffnessBound>{"StiffnessBound"},
    Named<rt::VelocityClaim>{"VelocityClaim"},
    Named<rt::Tick>{"Tick"},
    Named<rt::LatencyProbe::Result>{"DeviceLatency"},
    Named<rt::StiffnessRules>{"StiffnessRules"},
    Named<rt::LoopCounters>{"LoopCounters"},
    Named<daemon::LoopStatus>{"Loop"},
    Named<drivers::CameraDetails>{"CameraDetails"},
    Named<drivers::CameraStatus>{"Camera"},
    Named<daemon::SceneStatus>{"Scene"},
    Named<drivers::HandlePresence>{"HandleState"},
    Named<drivers::LinkStatus>{"Link"},
    Named<drivers::HandleStatus>{"Handle"},
    Named<daemon::IndicatorStatus>{"Leds"},
    Named<trace::TraceState>{"TraceState"},
    Named<daemon::TraceStatus>{"Trace"},
    Named<daemon::ControlStatus>{"ControlThread"},
    Named<rt::FixtureStage>{"FixtureStage"},
    Named<daemon::FixtureConduct>{"FixtureConduct"},
    Named<daemon::FixtureStatus>{"Fixtures"},
    Named<rt::FrameState>{"FrameState"},
    Named<rt::PoseFault>{"PoseFault"},
    Named<rt::TrackingVerdict>{"TrackingVerdict"},
    Named<daemon::FrameStatus>{"FrameStatus"},
    Named<daemon::FeedStatus>{"Feed"},
    Named<daemon::TissueStatus>{"Tissue"},
    Named<daemon::BoxStatus>{"Status"},
    Named<daemon::PendingReload>{"PendingReload"},
    Named<config::Loosening>{"HeldChange"},
    Named<daemon::WindowStatus>{"Window"},
};

/// How the interface writes the type of a member that clients see. A number that is not finite is null.
template <typename Type>
std::string typeOf() {
  if constexpr (std::same_as<Type, bool>) {
    return "bool";
  } else if constexpr (std::integral<Type>) {
    return "int";
  } else if constexpr (std::floating_point<Type>) {
    return "?float";
  } else if constexpr (std::same_as<Type, std::string>) {
    return "string";
  } else if constexpr (std::same_as<Type, daemon::CountsByWord>) {
    return "[string]int";
  } else if constexpr (requires(Type value) { value.has_value(); }) {
    const std::string type = typeOf<typename Type::value_type>();
    return type.starts_with('?') ? type : "?" + type;
  } else if constexpr (requires { typename Type::value_type; }) {
    return "[]" + typeOf<typename Type::value_type>();
  } else {
    return std::string(std::get<Named<Type>>(kTypes).name);
  }
}

/// A comment in lines of at most 120 characters.
std::string comment(std::string_view text) {
  constexpr std::size_t kMaxLine = 120;
  std::string lines;
  std::string line = "  #";
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    const std::string_view word = text.substr(0, end);
    if (line.size() + 1 + word.size() > kMaxLine) lines += std::exchange(line, "  #") + "\n";
    line += fmt::format(" {}", word);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return lines + line + "\n";
}

/// The definition of a type; nothing for one that has neither words nor rows.
template <typename Type>
std::string definitionOf(std::string_view name) {
  if constexpr (rt::Worded<Type>) {
    return fmt::format("type {} ({})\n", name, fmt::join(rt::kWords<Type>, ", "));
  } else if constexpr (rt::Tabled<Type>) {
    std::string members;
    rt::forEachShownField<Type>([&](const auto& field) {
      using Shown = std::remove_cvref_t<decltype(field.show(std::declval<const Type&>()))>;
      fmt::format_to(std::back_inserter(members), "{}{}  {}: {}", members.empty() ? "" : ",\n",
                     comment(field.help), field.json_name.text(), typeOf<Shown>());
    });
    return fmt::format("type {} (\n{}\n)\n", name, members);
  } else {
    return {};
  }
}

/// The generated definition that begins with this line ("type Law (..."); nothing: the type is written by
/// hand.
std::optional<std::string> generatedFor(std::string_view line) {
  std::optional<std::string> found;
  const auto consider = [&]<typename Type>(const Named<Type>& type) {
    if (!line.starts_with(fmt::format("type {} (", type.name))) return;
    std::string definition = definitionOf<Type>(type.name);
    if (!definition.empty()) found = std::move(definition);
  };
  std::apply([&](const auto&... types) { (consider(types), ...); }, kTypes);
  return found;
}

}  // namespace

std::string withTypes(std::string_view interface) {
  std::string text;
  bool replaced = false;  // the lines up to the end of the type
  while (!interface.empty()) {
    const std::size_t end = std::min(interface.find('\n'), interface.size());
    const std::string_view line = interface.substr(0, end);
    interface.remove_prefix(std::min(end + 1, interface.size()));
    if (std::exchange(replaced, replaced && line != ")")) continue;
    if (const auto generated = generatedFor(line)) {
      text += *generated;
      replaced = line.ends_with('(');
    } else {
      text += fmt::format("{}\n", line);
    }
  }
  return text;
}

}  // namespace hapticd::tools
