// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <utility>

#include "tools/lib/client/reply_reader.h"

/// What a reply says, as rows for people: each row is a pattern with the paths of the fields that
/// it shows.
namespace hapticd::tools {

/// The pattern with fields of the reply in place of what stands in braces: "{loop.rateHz:.1} Hz". A path
/// alone is the text there; behind a colon stands how another field is shown, and "-" where there is none:
///   .2, .2*1000   a number with two digits after the point, multiplied
///   #, #tick(s)   a number without digits, and with what it counts, as counted() takes it
///   ns, age, mm, bytes   a number of nanoseconds, seconds, metres, bytes, in the unit that suits it
///   (.3, |.3      a vector {x, y, z}, and its length
///   latency       a distribution of nanoseconds
/// and behind that <9 or >9 the columns that it takes. "{loop.memoryLocked?locked|not locked}" shows a flag.
std::string filled(const Json& reply, std::string_view pattern);

/// "force loop    1000.0 Hz": one row of a status, without a line's end.
std::string statusRow(std::string_view title, const std::string& text);

/// The title of a row and its text; a row without text is not shown.
using Row = std::pair<const char*, std::string>;

/// "3.2 mm"; "-" for NaN. Fixtures act within a few millimetres.
std::string millimetres(double metres);

/// "850 B", "12.3 kB", "12.3 MB", "1.2 GB", in powers of ten as disks are sold; "-" for NaN.
std::string bytesText(double bytes);

}  // namespace hapticd::tools
