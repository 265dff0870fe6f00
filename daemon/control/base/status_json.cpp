// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/base/status_json.h"

#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "config/settings/law_choice.h"
#include "daemon/base/journal_entry.h"
#include "daemon/control/base/interface_texts.h"
#include "rt/base/fields.h"
#include "rt/laws/law_table.h"

namespace hapticd::daemon {
namespace {

template <typename Value>
OrderedJson jsonOf(const Value& value);

template <typename Value>
constexpr bool kIsOptional = false;
template <typename Value>
constexpr bool kIsOptional<std::optional<Value>> = true;

// Not inlined, because there are hundreds of fields.
[[gnu::noinline]] void add(OrderedJson& object, std::string_view name, OrderedJson value) {
  object[std::string(name)] = std::move(value);
}

template <typename Record>
OrderedJson objectOf(const Record& record) {
  OrderedJson object = OrderedJson::object();
  rt::forEachShownField<Record>(
      [&](const auto& field) { add(object, field.json_name.text(), jsonOf(field.show(record))); });
  return object;
}

/// A number that is not finite is null.
template <typename Value>
OrderedJson jsonOf(const Value& value) {
  if constexpr (rt::Tabled<Value>) {
    return objectOf(value);
  } else if constexpr (rt::Worded<Value>) {
    return nameOf(value);
  } else if constexpr (std::is_same_v<Value, double>) {
    return std::isfinite(value) ? OrderedJson(value) : OrderedJson();
  } else if constexpr (std::is_same_v<Value, rt::Vec3>) {
    return {{"x", value.x}, {"y", value.y}, {"z", value.z}};
  } else if constexpr (kIsOptional<Value>) {
    return value ? jsonOf(*value) : OrderedJson();
  } else if constexpr (std::is_same_v<Value, CountsByWord>) {
    OrderedJson counts = OrderedJson::object();
    for (const auto& [word, count] : value) counts[std::string(word)] = count;
    return counts;
  } else if constexpr (requires { typename Value::value_type; } && !std::is_same_v<Value, std::string>) {
    OrderedJson list = OrderedJson::array();
    for (const auto& item : value) list.push_back(jsonOf(item));
    return list;
  } else {
    return value;
  }
}

}  // namespace

OrderedJson tickJson(const rt::Tick& tick) {
  return jsonOf(tick);
}

OrderedJson statusJson(const BoxStatus& status) {
  return jsonOf(status);
}

OrderedJson pendingReloadJson(const std::optional<PendingReload>& pending) {
  return jsonOf(pending);
}

OrderedJson conductJson(const FixtureConduct& conduct) {
  return jsonOf(conduct);
}

OrderedJson windowJson(const WindowStatus& window) {
  return jsonOf(window);
}

}  // namespace hapticd::daemon
