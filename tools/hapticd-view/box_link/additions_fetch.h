// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "rt/loop_state.h"
#include "tools/hapticd-view/box_link/varlink_stream.h"

namespace hapticd::tools::view {

/// Asks a box for its fixtures and tissue regions whenever a tick was computed with others than those known.
/// Thread: the io_context's.
class AdditionsFetch {
 public:
  /// An estimator may change the regions many times a second.
  static constexpr std::chrono::milliseconds kPause{500};
  /// Receives {"fixtures": [...], "regions": [...]}: entries of ListFixtures and ListRegions.
  using OnChange = std::function<void(const Json& additions)>;

  AdditionsFetch(boost::asio::io_context& context, std::string socket, OnChange on_change);
  ~AdditionsFetch() { forget(); }
  AdditionsFetch(const AdditionsFetch&) = delete;
  AdditionsFetch& operator=(const AdditionsFetch&) = delete;

  void onTick(const rt::Tick& tick);
  /// Ends what is under way; nothing is known afterwards.
  void forget();

 private:
  /// One of the two lists.
  struct List {
    const char* method;
    const char* member;
    std::uint64_t current = 0;  ///< generation in the newest tick; 0: none, which needs no call
    std::uint64_t known = 0;    ///< generation of `entries`
    Json entries = Json::array();
    std::shared_ptr<VarlinkStream> call = {};
  };

  void fetchWhatChanged();
  void fetch(List& list);
  void take(List& list, const Json& reply);

  boost::asio::io_context& context_;
  boost::asio::steady_timer pause_;
  bool pausing_ = false;
  std::string socket_;
  OnChange on_change_;
  List fixtures_{"io.hapticd.Status.ListFixtures", "fixtures"};
  List regions_{"io.hapticd.Status.ListRegions", "regions"};
};

}  // namespace hapticd::tools::view
