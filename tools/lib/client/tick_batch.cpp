// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/client/tick_batch.h"

#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "daemon/trace/format/records.h"
#include "rt/base/words.h"
#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools {
namespace {

/// No reply of the daemon holds more.
constexpr std::size_t kMaxTicksInReply = 1000;

double numberOf(const Json& json) {
  return json.is_number() ? json.get<double>() : std::numeric_limits<double>::quiet_NaN();
}

void read(const Json& json, bool& value) {
  if (json.is_boolean()) value = json.get<bool>();
}
template <std::integral Integer>
void read(const Json& json, Integer& value) {
  if (json.is_number_integer()) value = json.get<Integer>();
}
/// JSON has no infinite numbers either: null stays infinite where that is the default.
void read(const Json& json, double& value) {
  if (json.is_number() || !std::isinf(value)) value = numberOf(json);
}
void read(const Json& json, rt::Vec3& value) {
  if (!json.is_array() || json.size() != 3) return;
  value = {numberOf(json[0]), numberOf(json[1]), numberOf(json[2])};
}
template <rt::Worded Enumeration>
void read(const Json& json, Enumeration& value) {
  if (!json.is_string()) return;
  if (const auto known = rt::withWord<Enumeration>(json.get_ref<const std::string&>())) value = *known;
}

/// The fields of a tick by name: their places in the order of visitFields().
const std::unordered_map<std::string_view, std::size_t>& places() {
  static const std::unordered_map<std::string_view, std::size_t> all = [] {
    std::unordered_map<std::string_view, std::size_t> by_name;
    const rt::Tick tick;
    trace::visitFields(tick,
                       [&](std::string_view name, const auto&) { by_name.emplace(name, by_name.size()); });
    return by_name;
  }();
  return all;
}

}  // namespace

Json allTickFields() {
  Json names = Json::array();
  const rt::Tick tick;
  trace::visitFields(tick, [&names](std::string_view name, const auto&) { names.push_back(name); });
  return names;
}

void forEachTick(const Json& reply, const std::function<void(const rt::Tick&)>& take) {
  const Json* columns = fieldAt(reply, "ticks");
  const double count = numberAt(reply, "count");
  if (columns == nullptr || !columns->is_object() || !(count >= 0 && count <= kMaxTicksInReply)) return;
  std::vector<rt::Tick> ticks(static_cast<std::size_t>(count));
  // looked up once per field, and not once per tick
  std::vector<const Json*> lists(places().size(), nullptr);
  for (const auto& [name, list] : columns->items()) {
    const auto place = places().find(name);
    if (place != places().end() && list.is_array() && list.size() >= ticks.size())
      lists[place->second] = &list;
  }
  for (std::size_t row = 0; row < ticks.size(); ++row) {
    auto list = lists.begin();
    trace::visitFields(ticks[row], [&](std::string_view, auto& value) {
      if (*list != nullptr) read((**list)[row], value);
      ++list;
    });
    take(ticks[row]);
  }
}

}  // namespace hapticd::tools
