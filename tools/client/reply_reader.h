// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "config/value_text.h"
#include "tools/client/varlink_client.h"

namespace hapticd::tools {

/// The field at `path` ("loop.counters.ticks"); null when it is not there. Nothing in a reply is taken for
/// granted: the daemon may be older or newer than this program.
const Json* fieldAt(const Json& json, std::string_view path);

/// NaN when it is not a number.
double numberAt(const Json& json, std::string_view path);
/// "-" when it is not a string.
std::string textAt(const Json& json, std::string_view path);
bool flagAt(const Json& json, std::string_view path);
/// An empty array when it is not one.
const Json& listAt(const Json& json, std::string_view path);

/// The field "name" of each that is listed at `path`, a line each.
std::string namesText(const Json& json, std::string_view path);

/// "42", or "-" when it is not a number.
std::string countAt(const Json& json, std::string_view path);
/// Length of the vector {x, y, z}; NaN when it is none.
double lengthAt(const Json& json, std::string_view path);

/// A number with `digits` after the point; "-" for NaN.
std::string fixed(double value, int digits);
/// "850 ns", "12.3 us", "4.56 ms", "1.20 s"; "-" for NaN.
std::string duration(double nanoseconds);

/// "500", "true", "paper": a parameter's value as people write it.
std::string valueText(const Json& value);

using config::printable;

}  // namespace hapticd::tools
