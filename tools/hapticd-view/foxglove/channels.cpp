// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/foxglove/channels.h"

#include "drivers/trace/foxglove_schemas.h"

namespace hapticd::tools::view {
namespace {

namespace foxglove = drivers::foxglove;

/// By the value of FoxgloveChannel.
constexpr std::array<drivers::ChannelName, kFoxgloveChannels> kNames{
    drivers::kChannelName<rt::Tick>, foxglove::kSceneChannel,      foxglove::kTransformsChannel,
    foxglove::kCloudChannel,         foxglove::kReachCloudChannel, foxglove::kImageChannel,
    foxglove::kCalibrationChannel,   foxglove::kLogChannel};

std::string schemaOf(FoxgloveChannel channel) {
  if (channel == FoxgloveChannel::tick) return drivers::schemaOf<rt::Tick>();
  return std::string(foxglove::schemaOf(nameOf(channel).schema));
}

}  // namespace

drivers::ChannelName nameOf(FoxgloveChannel channel) {
  return kNames[static_cast<std::size_t>(channel)];
}

std::optional<FoxgloveChannel> foxgloveChannelOf(std::uint64_t id) {
  if (id < 1 || id > kFoxgloveChannels) return std::nullopt;
  return static_cast<FoxgloveChannel>(id - 1);
}

Json advertisement() {
  Json channels = Json::array();
  for (std::uint32_t id = 1; id <= kFoxgloveChannels; ++id) {
    const FoxgloveChannel channel = *foxgloveChannelOf(id);
    const auto& [topic, schema] = nameOf(channel);
    channels.push_back({{"id", id},
                        {"topic", topic},
                        {"encoding", "cdr"},
                        {"schemaName", schema},
                        {"schemaEncoding", "ros2msg"},
                        {"schema", schemaOf(channel)}});
  }
  return {{"op", "advertise"}, {"channels", std::move(channels)}};
}

}  // namespace hapticd::tools::view
