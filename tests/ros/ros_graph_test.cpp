// SPDX-License-Identifier: Apache-2.0
// Which settings of DDS match: what `hapticctl ros` says against what Cyclone DDS does.
#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <random>

#include "ros_messages.h"
#include "tests/ros/ros_listener.h"
#include "tools/hapticd-ros/dds/ros_graph.h"

namespace hapticd::test {
namespace {

using Qos = std::unique_ptr<dds_qos_t, decltype(&dds_delete_qos)>;

constexpr std::array kPeriods_ns{DDS_MSECS(10), DDS_MSECS(200), DDS_INFINITY};

/// Random settings of all that decides whether a writer and a reader match.
Qos randomQos(std::mt19937& random) {
  Qos qos(dds_create_qos(), dds_delete_qos);
  const auto any = [&random](auto count) {
    return std::uniform_int_distribution<int>(0, static_cast<int>(count) - 1)(random);
  };
  dds_qset_reliability(qos.get(), static_cast<dds_reliability_kind_t>(any(2)), DDS_MSECS(1));
  dds_qset_durability(qos.get(), static_cast<dds_durability_kind_t>(any(2)));
  dds_qset_deadline(qos.get(), kPeriods_ns[static_cast<std::size_t>(any(3))]);
  dds_qset_liveliness(qos.get(), static_cast<dds_liveliness_kind_t>(any(3)),
                      kPeriods_ns[static_cast<std::size_t>(any(3))]);
  dds_qset_ownership(qos.get(), any(4) == 0 ? DDS_OWNERSHIP_EXCLUSIVE : DDS_OWNERSHIP_SHARED);
  return qos;
}

TEST(RosGraph, SaysThatSettingsDoNotMatchExactlyWhereDdsDoesNotMatchThem) {
  std::mt19937 random(7);
  const auto domain = static_cast<dds_domainid_t>(ownDomain());
  const dds_entity_t participant = dds_create_participant(domain, nullptr, nullptr);
  ASSERT_GT(participant, 0);
  const dds_entity_t topic =
      dds_create_topic(participant, &std_msgs_msg_dds__Bool__desc, "rt/match", nullptr, nullptr);
  int matched = 0;
  constexpr int kPairs = 1000;
  for (int pair = 0; pair < kPairs; ++pair) {
    const Qos offered = randomQos(random);
    const Qos requested = randomQos(random);
    const dds_entity_t writer = dds_create_writer(participant, topic, offered.get(), nullptr);
    const dds_entity_t reader = dds_create_reader(participant, topic, requested.get(), nullptr);
    dds_subscription_matched_status_t status{};
    ASSERT_EQ(dds_get_subscription_matched_status(reader, &status), DDS_RETCODE_OK);
    const std::string mismatch = tools::ros::mismatchOf(offered.get(), requested.get());
    EXPECT_EQ(mismatch.empty(), status.current_count == 1) << mismatch;
    matched += static_cast<int>(status.current_count);
    dds_delete(reader);
    dds_delete(writer);
  }
  EXPECT_GT(matched, kPairs / 50);
  EXPECT_LT(matched, kPairs / 2);
  dds_delete(participant);
}

TEST(RosGraph, NamesBothSidesOfAMismatch) {
  Qos offered(dds_create_qos(), dds_delete_qos);
  Qos requested(dds_create_qos(), dds_delete_qos);
  dds_qset_reliability(offered.get(), DDS_RELIABILITY_BEST_EFFORT, 0);
  dds_qset_reliability(requested.get(), DDS_RELIABILITY_RELIABLE, 0);
  dds_qset_deadline(requested.get(), DDS_MSECS(10));
  EXPECT_EQ(tools::ros::mismatchOf(offered.get(), requested.get()),
            "reliability: best effort is offered, reliable is requested; deadline: none is offered, 10 ms is "
            "requested");
}

}  // namespace
}  // namespace hapticd::test
