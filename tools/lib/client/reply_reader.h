// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "config/base/value_text.h"
#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools {

/// The field at `path` ("loop.counters.ticks"); a null pointer if it is absent. No field of a reply is taken
/// for granted: the daemon may be older or newer than this program.
const Json* fieldAt(const Json& json, std::string_view path);

/// The number at `path`; NaN if there is none.
double numberAt(const Json& json, std::string_view path);
/// The string at `path`, made printable; "-" if there is none.
std::string textAt(const Json& json, std::string_view path);
bool flagAt(const Json& json, std::string_view path);
/// The array at `path`; an empty one if there is none.
const Json& listAt(const Json& json, std::string_view path);

/// The field "name" of each object of the array at `path`, a line each.
std::string namesText(const Json& json, std::string_view path);

/// The number at `path` without decimals, "42"; "-" if there is none.
std::string countAt(const Json& json, std::string_view path);
/// The length of the vector {x, y, z} at `path`; NaN if there is none.
double lengthAt(const Json& json, std::string_view path);

/// A number with `digits` after the point; "-" for NaN.
std::string fixed(double value, int digits);
/// "850 ns", "12.3 us", "4.56 ms", "1.20 s"; "-" for NaN.
std::string duration(double nanoseconds);

/// A parameter's value as people write it: "500", "true", "surface".
std::string valueText(const Json& value);

using base::printable;

}  // namespace hapticd::tools
