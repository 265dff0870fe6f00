// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <dds/dds.h>

#include <functional>
#include <string>
#include <string_view>

struct ddsi_sertype;

/// Topics whose samples are messages in CDR, as they are in files: Cyclone DDS neither makes nor reads them,
/// so it needs no description of their types. Thread: as of Cyclone DDS, any.  RT: not safe.
namespace hapticd::tools::ros {

struct CdrTopic {
  dds_entity_t entity = 0;             ///< negative: an error of Cyclone DDS
  const ddsi_sertype* type = nullptr;  ///< lives as long as the topic
};

/// A topic without a key in XCDR1, deleted with the participant. `name` and `type`: in DDS.
CdrTopic createCdrTopic(dds_entity_t participant, const std::string& name, const std::string& type);

/// Writes a message to a topic of that type. `message`: with the four bytes of the encoding in front.
/// Returns DDS_RETCODE_OK or an error of Cyclone DDS.
dds_return_t writeCdr(dds_entity_t writer, const ddsi_sertype& type, std::string message);

/// Calls take(message, info) for all messages that a reader of such a topic has, oldest first. They are valid
/// during the call, and may be anything but shorter than the bytes of the encoding.
void takeCdr(dds_entity_t reader,
             const std::function<void(std::string_view message, const dds_sample_info_t& info)>& take);

}  // namespace hapticd::tools::ros
