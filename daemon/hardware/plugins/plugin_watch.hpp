#pragma once
// Sees from another thread when the code of a plugin keeps the loop waiting.

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

namespace weft::daemon {

/// What is being called, for sentences. The texts outlive the call.
struct PluginCall {
  const char* device;    ///< "taxels"
  const char* file;      ///< the shared object
  const char* function;  ///< "received"
};

/// One per program. Two limits: a call that returns late can be told so; one that does not return
/// at all cannot be ended, and is reported on the watch's own thread. Wall time, whatever the loop.
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

  /// While it lives the loop's thread is inside `call`, or with nullptr back in the host's own code
  /// that the plugin called. Turns nest. `call` outlives it.
  class Turn {
   public:
    Turn(PluginWatch& watch, const PluginCall* call);
    ~Turn();
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;
    /// The limit was passed in this turn; the host's turns within it do not count.
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

}  // namespace weft::daemon
