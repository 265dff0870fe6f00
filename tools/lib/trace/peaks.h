// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <utility>

namespace hapticd::tools {

/// Reduces `count` items to at most `most`, in their order: of each stretch it keeps the items with the least
/// and the largest value. NaN counts as the largest value. If there are no more than `most` items, it keeps
/// all.
template <typename Item>
class Peaks {
 public:
  using Emit = std::function<void(const Item&)>;

  /// `most` >= 2.
  Peaks(std::uint64_t count, std::size_t most, Emit emit)
      : count_(count), stretches_(count <= most ? 0 : most / 2), emit_(std::move(emit)) {}

  void add(double value, const Item& item) {
    const std::uint64_t index = index_++;
    if (stretches_ == 0) return emit_(item);
    // in floating point, because the product may exceed any integer; rounding may move a border by one item
    const auto stretch = static_cast<std::uint64_t>(static_cast<double>(index) / static_cast<double>(count_) *
                                                    static_cast<double>(stretches_));
    if (stretch != stretch_) finish();
    stretch_ = stretch;
    const double key = std::isnan(value) ? std::numeric_limits<double>::infinity() : value;
    if (!least_ || key < least_->value) least_ = {index, key, item};
    if (!largest_ || key > largest_->value) largest_ = {index, key, item};
  }

  /// To be called after the last item.
  void finish() {
    if (least_) {
      const auto& [first, second] = std::minmax(*least_, *largest_, earlier);
      emit_(first.item);
      if (second.index != first.index) emit_(second.item);
    }
    least_.reset();
    largest_.reset();
  }

 private:
  struct Found {
    std::uint64_t index;
    double value;
    Item item;
  };
  static bool earlier(const Found& a, const Found& b) { return a.index < b.index; }

  std::uint64_t count_;
  std::uint64_t stretches_;
  Emit emit_;
  std::uint64_t index_ = 0;
  std::uint64_t stretch_ = 0;
  std::optional<Found> least_;
  std::optional<Found> largest_;
};

}  // namespace hapticd::tools
