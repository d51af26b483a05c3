#pragma once
// A driver behind the C table of a plugin. Faulty code of the plugin does not damage this side:
// exceptions and long calls become a fault of its device.

#include <chrono>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "drivers/api/driver.hpp"
#include "drivers/api/weft_driver.h"

namespace weft::daemon {

// Detects from another thread that a plugin's code blocks the loop.

/// The current call, for messages. The texts outlive the call.
struct PluginCall {
  const char* device;    ///< "taxels"
  const char* file;      ///< the shared object
  const char* function;  ///< "received"
};

/// One per program. Two limits: a call that returns late is reported after it returns. A call that
/// does not return cannot be ended; it is reported on the watch's own thread. Wall time, whatever
/// the loop.
class PluginWatch {
 public:
  struct Limits {
    std::chrono::milliseconds late{1000};
    std::chrono::milliseconds hung{5000};
  };
  using Hung = std::function<void(const PluginCall&)>;

  PluginWatch(Limits limits, Hung hung);
  ~PluginWatch();
  PluginWatch(const PluginWatch&) = delete;
  PluginWatch& operator=(const PluginWatch&) = delete;
  [[nodiscard]] const Limits& limits() const { return limits_; }

  /// While a turn exists, the loop's thread is inside `call`. With nullptr it is back in the host's
  /// own code that the plugin called. Turns nest. `call` outlives it.
  class Turn {
   public:
    Turn(PluginWatch& watch, const PluginCall* call);
    ~Turn();
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;
    /// The limit was exceeded in this turn; the host's turns within it do not count.
    [[nodiscard]] bool late() const;

   private:
    friend class PluginWatch;
    PluginWatch* watch_;
    const PluginCall* call_;
    Turn* outer_;
    std::chrono::milliseconds lasted_{};
  };

 private:
  void watch();

  Limits limits_;
  Hung hung_;
  mutable std::mutex guard_;
  std::condition_variable wake_;
  Turn* turn_ = nullptr;  ///< innermost
  bool ending_ = false;
  std::thread thread_;
};

/// A table that the loader has checked, and the library that contains it.
struct LoadedPlugin {
  std::shared_ptr<void> library;
  const weft_driver_entry_v1* table = nullptr;
  std::string file;
};

/// Thread-bound to the loop of its host. `watch` and `host` outlive it.
class PluginDriver final : public Driver {
 public:
  /// Errors: the driver's own; driver if its code threw an exception or blocked the program.
  static Result<std::unique_ptr<Driver>> create(const LoadedPlugin& plugin,
                                                const std::string& device,
                                                std::string_view config_json, DriverHost& host,
                                                PluginWatch& watch);
  ~PluginDriver() override;
  PluginDriver(const PluginDriver&) = delete;
  PluginDriver& operator=(const PluginDriver&) = delete;

  [[nodiscard]] DriverState state() const noexcept override { return state_; }
  Status open() override;
  Status arm() override;
  Result<std::uint32_t> command(const Command& command) override;
  void stop() override;
  void close() override;

 private:
  PluginDriver(LoadedPlugin plugin, const std::string& device, DriverHost& host,
               PluginWatch& watch);
  friend struct HostTable;
  friend struct LinkTable;

  /// One link of the device, and the plugin's callbacks for it.
  struct Port {
    PluginDriver* driver;
    Link* link;
    weft_link_v1 table;
    weft_received_v1 received = nullptr;
    void* received_context = nullptr;
    weft_closed_v1 closed = nullptr;
    void* closed_context = nullptr;
    Error error = {};  ///< of the last write that failed
    weft_error_v1 error_c = {};
  };
  void open_port(std::unique_ptr<Port>& port, Link* link);

  /// Runs one call into the plugin; the outermost one handles the errors of all.
  template <class Call>
  void enter(const char* function, const Call& call);
  template <class Call>
  Status call_plugin(const char* function, const Call& call);
  void record_exception(const std::string& what);
  void record_late();
  void record_error(Error error);
  /// Ends the device: stops motion and streams as far as its code still can, then makes no further
  /// call.
  void break_off();
  void let_go();

  LoadedPlugin plugin_;
  DriverHost* host_;
  PluginWatch* watch_;
  std::string device_name_;
  const char* function_ = "";  ///< the innermost call
  weft_host_v1 table_;
  weft_device* device_ = nullptr;
  DriverState state_ = DriverState::closed;

  std::map<std::uint64_t, TimerId> timers_;
  std::uint64_t last_timer_ = 0;
  std::unique_ptr<Port> link_;
  std::unique_ptr<Port> http_;  ///< nullptr: the device has none

  int depth_ = 0;                 ///< nested calls into the plugin
  std::optional<Error> refused_;  ///< reason given by the current call
  std::optional<Error> broken_;   ///< why no further call is made to the plugin
  bool broken_off_ = false;
};

}  // namespace weft::daemon
