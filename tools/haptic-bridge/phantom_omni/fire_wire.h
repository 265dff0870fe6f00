// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <libraw1394/raw1394.h>

#include <cstdint>
#include <memory>
#include <string>

#include "config/base/error.h"

namespace hapticd::tools::phantom_omni {

struct CloseFireWire {
  void operator()(raw1394_handle* handle) const { raw1394_destroy_handle(handle); }
};
/// A handle of libraw1394 on one port, with at most one isochronous context. Thread: one.
using FireWire = std::unique_ptr<raw1394_handle, CloseFireWire>;

/// An Omni on a bus.
struct OmniNode {
  int port = 0;
  nodeid_t node = 0;  ///< until the bus is reset
  std::string serial;
};

/// Errors: there is no such port, or it may not be opened.
base::Result<FireWire> openPort(int port);

/// The Omni with this serial number, or the first one if it is empty.
/// Errors: there is none, or the nodes of the bus may not be opened.
base::Result<OmniNode> findOmni(const std::string& serial);

/// The node that the Omni has on the port of `handle` now.  Errors: it is not there.
base::Result<nodeid_t> nodeOf(raw1394_handle* handle, const std::string& serial);

/// The text of a register that holds a serial number.
std::string serialText(std::uint32_t packed);

}  // namespace hapticd::tools::phantom_omni
