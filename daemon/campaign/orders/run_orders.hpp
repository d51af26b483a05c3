#pragma once
// What people and programs ask of a run that is under way on another thread, and what it reports.

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "daemon/campaign/orders/run_forecast.hpp"
#include "protocols/base/result.hpp"
#include "recipes/engine/engine.hpp"

namespace weft::daemon {

/// Events that the effects of a machine cause wait in line, so that the machine never runs inside
/// itself.
template <class Event>
class EventQueue {
 public:
  /// Takes `event` and, unless a call further out does so, hands it and all that it causes to
  /// `take`, one after the other.
  void dispatch(Event event, const std::function<void(const Event&)>& take) {
    waiting_.push_back(std::move(event));
    if (std::exchange(dispatching_, true)) return;
    while (!waiting_.empty()) {
      const Event next = std::move(waiting_.front());
      waiting_.pop_front();
      take(next);
    }
    dispatching_ = false;
  }

 private:
  std::deque<Event> waiting_;
  bool dispatching_ = false;
};

enum class Order : std::uint8_t { pause, pause_now, resume, confirm, stop, abort, halt };
std::string_view to_string(Order order);

struct GivenOrder {
  Order order = Order::pause;
  std::string by;                ///< session, user or rule
  recipes::Ticket confirms = 0;  ///< of what was asked, where it is a confirmation
};

/// Where a run is.
struct RunStatusUpdate {
  std::size_t trial = 0;  ///< of `planned`
  std::size_t planned = 0;
  recipes::Step step = recipes::Step::ready;
  std::string fabric;
  std::string exploration;
  std::uint32_t repetition = 0;
  double virtual_s = 0;  ///< on the bench's clock
  RunForecast forecast = {};
  /// What a person is asked for now; its ticket goes back with Order::confirm.
  std::optional<recipes::PromptOperator> requested = {};
  /// The next that a person will be asked for, where nothing is asked now.
  std::optional<recipes::StepPrompt> next_prompt = {};
};

/// A fault for a device of a simulated or emulated bench, or the end of some.
struct FaultOrder {
  std::string json;   ///< an entry of `simulation.faults`; of an end "device" and "fault", or ""
  bool ends = false;  ///< those faults of the device
  std::string by;
  /// What came of it; on any thread. The answer is posted when its last copy is dropped, also where
  /// it was never called.
  std::function<void(const Status&)> callback;
};

/// The engine's event for it.
recipes::Event event_of(const GivenOrder& given);

/// Given from any thread, taken by the run's own.
class RunOrders {
 public:
  void give(GivenOrder order);
  void give(FaultOrder order);
  /// Whether there is neither order nor fault. Costs two loads of atomics.
  [[nodiscard]] bool is_idle() const {
    return !any_.load(std::memory_order_relaxed) && !any_fault_.load(std::memory_order_relaxed);
  }
  /// The next one. Costs one load of an atomic when there is none.
  std::optional<GivenOrder> take();
  std::optional<FaultOrder> next_fault();
  /// True when there is an order, false when none came in time. For a run whose clock does not pass
  /// by itself.
  bool wait(std::chrono::milliseconds most);
  /// Whether one that ends the run has been given, taken or not.
  [[nodiscard]] bool ends_run() const { return ends_.load(std::memory_order_relaxed); }

 private:
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::deque<GivenOrder> waiting_;
  std::deque<FaultOrder> faults_;
  std::atomic<bool> any_ = false, any_fault_ = false;
  std::atomic<bool> ends_ = false;
};

}  // namespace weft::daemon
