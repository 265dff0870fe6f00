// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/box_link/additions_fetch.h"

#include <utility>

#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools::view {
namespace {

/// A daemon that does not answer for so long hangs.
constexpr std::chrono::seconds kSilence{3};

}  // namespace

AdditionsFetch::AdditionsFetch(boost::asio::io_context& context, std::string socket, OnChange on_change)
    : context_(context), pause_(context), socket_(std::move(socket)), on_change_(std::move(on_change)) {}

void AdditionsFetch::forget() {
  pause_.cancel();
  pausing_ = false;
  for (List* const list : {&fixtures_, &regions_}) {
    if (list->call) list->call->stop();
    *list = {list->method, list->member};
  }
}

void AdditionsFetch::onTick(const rt::Tick& tick) {
  fixtures_.current = tick.fixture_generation;
  regions_.current = tick.tissue_generation;
  fetchWhatChanged();
}

void AdditionsFetch::fetchWhatChanged() {
  const bool changed = fixtures_.current != fixtures_.known || regions_.current != regions_.known;
  if (!changed || pausing_ || fixtures_.call || regions_.call) return;
  for (List* const list : {&fixtures_, &regions_}) {
    if (list->current != list->known) fetch(*list);
  }
  pausing_ = true;
  pause_.expires_after(kPause);
  pause_.async_wait([this](const boost::system::error_code& cancelled) {
    if (!cancelled) pausing_ = false;  // the next tick asks again where that is needed
  });
}

void AdditionsFetch::fetch(List& list) {
  list.call = std::make_shared<VarlinkStream>(context_, kSilence);
  const auto on_reply = [this, &list](const Json& reply, const config::Descriptor&) { take(list, reply); };
  const auto on_end = [&list](const ClientError&) { list.call.reset(); };
  list.call->start(socket_, list.method, Json::object(), /*more=*/false, {on_reply, on_end});
}

void AdditionsFetch::take(List& list, const Json& reply) {
  // the list may be newer than the tick: then the next ticks are of that generation too
  const Json* const generation = fieldAt(reply, "generation");
  if (generation == nullptr || !generation->is_number_unsigned()) return;
  list.known = generation->get<std::uint64_t>();
  list.entries = listAt(reply, list.member);
  on_change_({{fixtures_.member, fixtures_.entries}, {regions_.member, regions_.entries}});
}

}  // namespace hapticd::tools::view
