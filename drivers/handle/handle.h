#pragma once

#include <string>

#include "config/error.h"
#include "rt/handle_channel.h"

namespace hapticd::drivers {

/// The two channels between a handle's thread and the force thread.
struct HandleChannels {
  rt::HandleStateChannel state;      ///< handle thread writes
  rt::HandleCommandChannel command;  ///< handle thread reads
};

struct HandleStatus {
  bool present = false;
  std::string detail;    ///< for people: why it is absent, and what to do
  std::string identity;  ///< driver and serial number
};

/// A haptic handle with a thread of its own: it publishes measurements and exerts the newest command.
class Handle {
 public:
  virtual ~Handle() = default;
  /// Starts the driver's thread. `channels` outlive stop().
  virtual config::Result<void> start(HandleChannels& channels) = 0;
  /// Exerts zero force, then ends the thread. Harmless when not started.
  virtual void stop() = 0;
  /// Thread: any.
  virtual HandleStatus status() const = 0;
};

}  // namespace hapticd::drivers
