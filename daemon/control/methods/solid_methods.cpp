// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "config/solids/solid_outline.h"
#include "daemon/control/base/method_context.h"
#include "daemon/control/methods/methods.h"

namespace hapticd::daemon {
namespace {

constexpr const char* kNoSolid = "io.hapticd.Status.NoSolid";

/// Coordinates are rounded to a tenth of a millimetre, which is finer than anybody sees.
constexpr double kStepsPerM = 1e4;
/// The longest coordinate that a solid can have, "-10.1234,".
constexpr std::size_t kMaxCoordinateBytes = 9;
static_assert(3 * config::kMaxOutlinePoints * kMaxCoordinateBytes < kMaxReplyBytes / 2);

double rounded_m(double coordinate_m) {
  return std::round(coordinate_m * kStepsPerM) / kStepsPerM + 0.0;  // not -0
}

/// x, y and z of each point, one after another; points that coincide once they are rounded only once.
OrderedJson numbersOf(const config::OutlineLine& line) {
  OrderedJson numbers = OrderedJson::array();
  std::optional<rt::Vec3> before;
  for (const rt::Vec3& point : line) {
    const rt::Vec3 place{rounded_m(point.x), rounded_m(point.y), rounded_m(point.z)};
    if (place == before) continue;
    before = place;
    for (const double coordinate_m : {place.x, place.y, place.z}) numbers.push_back(coordinate_m);
  }
  return numbers;
}

OrderedJson describe(const config::Solid& solid) {
  constexpr std::size_t kFewestNumbers = 6;  // of two points
  const rt::DistanceGrid& grid = solid.grid();
  OrderedJson outline = OrderedJson::array();
  for (const config::OutlineLine& line : config::outlineOf(grid)) {
    OrderedJson numbers = numbersOf(line);
    if (numbers.size() >= kFewestNumbers) outline.push_back(std::move(numbers));
  }
  return {{"source", solid.about().source},
          {"errorM", solid.about().error_m},
          {"samples", grid.samples},
          {"spacingM", grid.spacing_m},
          {"outline", std::move(outline)}};
}

}  // namespace

std::vector<Method> SolidMethods::methods() {
  using Self = SolidMethods;
  return {methodOf(this, "io.hapticd.Status.GetSolid", &Self::getSolid,
                   {{"solid", isText, MethodParameter::required}}),
          methodOf(this, "io.hapticd.Control.StoreSolid", &Self::storeSolid)};
}

Answer SolidMethods::getSolid(const Call& call, const Caller&) {
  const auto sha256 = requiredText(call, "solid");
  auto solid = context_.box.solid(sha256);
  if (!solid) {
    return failed(kNoSolid,
                  context_.box.knowsSolid(sha256)
                      ? "is not in memory, because no fixture uses it or its file is being read or "
                        "cannot be read (see ListFixtures and the warnings of the status)"
                      : "is not known to the box (give the SHA-256 of a solid that a fixture has, as "
                        "ListFixtures shows it)");
  }
  if (context_.pending.full(Access::read)) return failed(kNoSolid, PendingAnswers::kFullReason);
  using Described = base::Result<OrderedJson>;
  const auto reply = [](const Described& described) {
    return described ? Reply{"", *described} : failed(kNoSolid, described.error().text());
  };
  // A client that has left does not make room for another call before the worker has done its work.
  return Later{PendingAnswers::Unawaited::finish,
               whenReady<Described>(worker_.run([solid]() -> Described { return describe(*solid); }), reply)};
}

Answer SolidMethods::storeSolid(const Call& call, const Caller&) {
  constexpr const char* kRefused = "io.hapticd.Control.SolidRefused";
  if (!call.descriptor) {
    return failed(kRefused, "no memory file came with the call (pass its descriptor along)");
  }
  if (context_.pending.full(Access::control)) return failed(kRefused, PendingAnswers::kFullReason);
  using Stored = base::Result<StoredSolid>;
  return Later{PendingAnswers::Unawaited::finish,
               whenReady<Stored>(context_.box.storeSolid(std::move(*call.descriptor)), [this](Stored stored) {
                 if (!stored) return failed(kRefused, stored.error().text());
                 const std::string sha256 = stored->solid->sha256();
                 if (const auto taken = context_.box.takeSolid(std::move(*stored)); !taken)
                   return failed(kRefused, taken.error().text());
                 return Reply{"", {{"solid", sha256}}};
               })};
}

}  // namespace hapticd::daemon
