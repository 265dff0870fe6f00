// SPDX-License-Identifier: Apache-2.0
#include "config/solids/solid_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <utility>

#include "config/base/sha256.h"
#include "config/base/value_text.h"

namespace hapticd::config {
namespace {

static_assert(std::endian::native == std::endian::little, "the file is little-endian");

constexpr std::string_view kMagic = "HAPTSOLD";
constexpr std::uint32_t kVersion = 1;

constexpr const char* kAgain = "add the fixture again from its mesh or label map";

// Where the members of the header are.
constexpr std::size_t kVersionAt = 8;
constexpr std::size_t kHeaderBytesAt = 12;
constexpr std::size_t kSamplesAt = 16;
constexpr std::size_t kReservedAt = 28;
constexpr std::size_t kSpacingAt = 32;
constexpr std::size_t kOriginAt = 40;
constexpr std::size_t kScaleAt = 64;
constexpr std::size_t kErrorAt = 72;
constexpr std::size_t kUnusedAt = 80;
constexpr std::size_t kSourceAt = 96;
static_assert(kSourceAt + Solid::kMaxSource == kSolidHeaderBytes);

constexpr double kMinSpacing_m = 1e-5;
constexpr double kMaxSpacing_m = 0.05;
constexpr double kFarthest_m = 10;
constexpr double kMinScale_m = 1e-9;
constexpr double kMaxScale_m = 1e-3;
/// Coefficients of neighbours differ by at most this many spacings. Neighbouring samples of a distance differ
/// by at most one, and the inverse of the spline's (1 6 1) / 8 at most doubles that along each axis.
constexpr double kMaxSlope = 8;
/// Layers of samples at each side that are outside the solid: those that the spline reads there.
constexpr std::uint32_t kBorder = 2;

template <typename Value>
Value valueAt(std::string_view bytes, std::size_t at) {
  Value value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}
template <typename Value>
void put(std::string& bytes, std::size_t at, Value value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

/// The checks of one file.
class Reader {
 public:
  Reader(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  base::Result<void> check(rt::DistanceGrid& grid, Solid::About& about) const {
    if (bytes_.size() < kSolidHeaderBytes || !bytes_.starts_with(kMagic))
      return refuse("is not the file of a solid", "make one with hapticctl fixture add NAME --mesh FILE");
    if (const auto version = valueAt<std::uint32_t>(bytes_, kVersionAt); version != kVersion)
      return refuse(fmt::format("has version {}, and this program reads version {}", version, kVersion),
                    kAgain);
    const bool reserved_zero = valueAt<std::uint32_t>(bytes_, kReservedAt) == 0 &&
                               std::ranges::all_of(bytes_.substr(kUnusedAt, kSourceAt - kUnusedAt),
                                                   [](char byte) { return byte == 0; });
    if (valueAt<std::uint32_t>(bytes_, kHeaderBytesAt) != kSolidHeaderBytes || !reserved_zero)
      return damaged("its header has members that version 1 does not have");
    for (std::size_t axis = 0; axis < 3; ++axis) {
      grid.samples[axis] = valueAt<std::uint32_t>(bytes_, kSamplesAt + 4 * axis);
      if (grid.samples[axis] < rt::kMinGridSamples || grid.samples[axis] > rt::kMaxGridSamples)
        return damaged(fmt::format("{} samples along axis {} are out of range ({}..{})", grid.samples[axis],
                                   "xyz"[axis], rt::kMinGridSamples, rt::kMaxGridSamples));
    }
    if (grid.size() > rt::kMaxGridCoefficients)
      return damaged(
          fmt::format("{} samples are more than the {} possible", grid.size(), rt::kMaxGridCoefficients));
    if (bytes_.size() != kSolidHeaderBytes + 2 * grid.size())
      return damaged(fmt::format("it has {} bytes, and its {} samples take {}", bytes_.size(), grid.size(),
                                 kSolidHeaderBytes + 2 * grid.size()));
    grid.spacing_m = valueAt<double>(bytes_, kSpacingAt);
    grid.scale_m = valueAt<double>(bytes_, kScaleAt);
    for (std::size_t axis = 0; axis < 3; ++axis)
      (&grid.origin_m.x)[axis] = valueAt<double>(bytes_, kOriginAt + 8 * axis);
    about.error_m = valueAt<double>(bytes_, kErrorAt);
    return checkNumbers(grid, about);
  }

 private:
  base::Result<void> checkNumbers(const rt::DistanceGrid& grid, Solid::About& about) const {
    const auto in = [](double value, double least, double most) { return value >= least && value <= most; };
    if (!in(grid.spacing_m, kMinSpacing_m, kMaxSpacing_m))
      return damaged(fmt::format("a spacing of {} m is out of range ({}..{} m)", grid.spacing_m,
                                 kMinSpacing_m, kMaxSpacing_m));
    if (!in(grid.scale_m, kMinScale_m, kMaxScale_m))
      return damaged(
          fmt::format("a scale of {} m is out of range ({}..{} m)", grid.scale_m, kMinScale_m, kMaxScale_m));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double first_m = (&grid.origin_m.x)[axis];
      const double last_m = first_m + grid.spacing_m * (grid.samples[axis] - 1);
      if (!in(first_m, -kFarthest_m, kFarthest_m) || !in(last_m, -kFarthest_m, kFarthest_m))
        return damaged(fmt::format("along axis {} it reaches from {} to {} m, beyond {}..{} m", "xyz"[axis],
                                   first_m, last_m, -kFarthest_m, kFarthest_m));
    }
    if (!in(about.error_m, 0, kFarthest_m))
      return damaged(fmt::format("an error of {} m is out of range (0..{} m)", about.error_m, kFarthest_m));
    const std::string_view source = bytes_.substr(kSourceAt, Solid::kMaxSource);
    about.source = source.substr(0, source.find('\0'));
    const bool ends = source.find_first_not_of('\0', about.source.size()) == std::string_view::npos;
    if (!ends || base::firstInvalidUtf8(about.source) || base::firstUnprintable(about.source))
      return damaged("the name of its source is no printable text");
    return {};
  }

  base::Result<void> refuse(std::string what, std::string remedy) const {
    return std::unexpected(base::Error{name_, std::move(what), std::move(remedy)});
  }
  base::Result<void> damaged(std::string_view what) const {
    return refuse(fmt::format("is damaged: {}", what), kAgain);
  }

  std::string_view bytes_;
  const std::string& name_;
};

/// Returns what a signed distance cannot be, or nothing.
std::string coefficientProblem(const rt::DistanceGrid& grid, const std::int16_t* coefficients) {
  const auto [nx, ny, nz] = grid.samples;
  const double most = kMaxSlope * grid.spacing_m / grid.scale_m;
  const std::size_t row = nx, layer = std::size_t{nx} * ny;
  const auto isBorder = [](std::uint32_t i, std::uint32_t n) { return i < kBorder || i >= n - kBorder; };
  for (std::uint32_t z = 0; z < nz; ++z) {
    for (std::uint32_t y = 0; y < ny; ++y) {
      const bool border_row = isBorder(z, nz) || isBorder(y, ny);
      const std::size_t first = z * layer + y * row;
      for (std::uint32_t x = 0; x < nx; ++x) {
        const int here = coefficients[first + x];
        const bool steep = (x > 0 && std::abs(here - coefficients[first + x - 1]) > most) ||
                           (y > 0 && std::abs(here - coefficients[first + x - row]) > most) ||
                           (z > 0 && std::abs(here - coefficients[first + x - layer]) > most);
        if (steep)
          return fmt::format(
              "at sample {}, {}, {} the coefficients change by more than {} m for each metre, which those of "
              "a "
              "distance never do",
              x, y, z, kMaxSlope);
        if ((border_row || isBorder(x, nx)) && here <= 0)
          return fmt::format("at sample {}, {}, {}, at its border, is a place inside the solid", x, y, z);
      }
    }
  }
  return {};
}

/// The coefficients in a file that holds as many as its header says.
const std::int16_t* coefficientsIn(std::string_view file) {
  return reinterpret_cast<const std::int16_t*>(file.data() + kSolidHeaderBytes);
}
static_assert(kSolidHeaderBytes % sizeof(double) == 0 && base::kReadableBehind >= sizeof(std::int16_t));

base::HeldBytes fileOf(const rt::DistanceGrid& grid, std::span<const std::int16_t> coefficients,
                       const Solid::About& about) {
  std::string bytes(kSolidHeaderBytes + coefficients.size_bytes(), '\0');
  std::ranges::copy(kMagic, bytes.begin());
  put(bytes, kVersionAt, kVersion);
  put(bytes, kHeaderBytesAt, static_cast<std::uint32_t>(kSolidHeaderBytes));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    put(bytes, kSamplesAt + 4 * axis, grid.samples[axis]);
    put(bytes, kOriginAt + 8 * axis, (&grid.origin_m.x)[axis]);
  }
  put(bytes, kSpacingAt, grid.spacing_m);
  put(bytes, kScaleAt, grid.scale_m);
  put(bytes, kErrorAt, about.error_m);
  std::ranges::copy(about.source.substr(0, Solid::kMaxSource), bytes.begin() + kSourceAt);
  std::memcpy(bytes.data() + kSolidHeaderBytes, coefficients.data(), coefficients.size_bytes());
  return base::heldCopy(bytes);
}

}  // namespace

Solid::Solid(const rt::DistanceGrid& grid, std::span<const std::int16_t> coefficients, About about)
    : Solid(grid, about, fileOf(grid, coefficients, about), {}) {}

Solid::Solid(const rt::DistanceGrid& grid, About about, base::HeldBytes file, std::string sha256)
    : grid_(grid), about_(std::move(about)), file_(std::move(file)), sha256_(std::move(sha256)) {
  grid_.coefficients = coefficientsIn(*file_);
  grid_.number = 0;
  constexpr std::size_t kDigits = 16;  // of 64 bits
  if (sha256_.size() >= kDigits) std::from_chars(sha256_.data(), sha256_.data() + kDigits, grid_.number, 16);
  grid_.number |= 1;  // 0: no grid
}

base::Result<std::shared_ptr<const Solid>> solidFrom(base::HeldBytes file, const std::string& name) {
  rt::DistanceGrid grid;
  Solid::About about;
  if (const auto checked = Reader(*file, name).check(grid, about); !checked)
    return std::unexpected(checked.error());
  if (std::string problem = coefficientProblem(grid, coefficientsIn(*file)); !problem.empty())
    return std::unexpected(base::Error{name, "is not a signed distance: " + problem, kAgain});
  std::string sha256 = base::sha256(*file);
  return std::make_shared<const Solid>(grid, std::move(about), std::move(file), std::move(sha256));
}

base::Result<std::shared_ptr<const Solid>> solidFrom(std::string_view bytes, const std::string& name) {
  return solidFrom(base::heldCopy(bytes), name);
}

std::string solidFileName(std::string_view sha256) {
  return fmt::format("{}.solid", sha256);
}

base::Result<std::shared_ptr<const Solid>> loadSolid(const std::filesystem::path& folder,
                                                     const std::string& sha256) {
  const std::filesystem::path file = folder / solidFileName(sha256);
  auto content = base::mappedCopy(file, {.longest = kMaxSolidBytes, .follow_link = false});
  if (!content) return std::unexpected(base::Error{file.string(), content.error().text(), kAgain});
  auto solid = solidFrom(std::move(*content), file.string());
  if (solid && (*solid)->sha256() != sha256)
    return std::unexpected(
        base::Error{file.string(), "is damaged: its content has another SHA-256 than its name", kAgain});
  return solid;
}

}  // namespace hapticd::config
