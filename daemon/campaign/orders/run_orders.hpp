#pragma once
// Orders of people and programs to a run on another thread, and the run's reports.

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

/// Queues the events that a machine's effects cause, so that the machine never runs inside itself.
template <class Event>
class EventQueue {
 public:
  /// Queues `event`. Unless an outer call does so already, passes it and all events that it causes
  /// to `take`, one after the other.
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
  recipes::Ticket confirms = 0;  ///< for a confirmation: the ticket of its prompt
};

/// Progress of a run.
struct RunStatusUpdate {
  std::size_t trial = 0;  ///< of `planned`
  std::size_t planned = 0;
  recipes::Step step = recipes::Step::ready;
  std::string fabric;
  std::string exploration;
  std::uint32_t repetition = 0;
  double virtual_s = 0;  ///< on the bench's clock
  RunForecast forecast = {};
  /// The open operator prompt; its ticket returns with Order::confirm.
  std::optional<recipes::PromptOperator> requested = {};
  /// The next operator step, if no prompt is open.
  std::optional<recipes::StepPrompt> next_prompt = {};
};

/// Injects a fault into a device of a simulated or emulated bench, or ends faults.
struct FaultOrder {
  std::string json;   ///< an entry of `simulation.faults`; to end: "device" and "fault", or ""
  bool ends = false;  ///< end those faults of the device
  std::string by;
  /// Receives the result, on any thread. The answer is posted when its last copy is destroyed, even
  /// if it was never called.
  std::function<void(const Status&)> callback;
};

/// The engine's event for the order.
recipes::Event event_of(const GivenOrder& given);

/// Orders are given from any thread and taken by the run's own.
class RunOrders {
 public:
  void give(GivenOrder order);
  void give(FaultOrder order);
  /// True if there is neither order nor fault. Costs two atomic loads.
  [[nodiscard]] bool is_idle() const {
    return !any_.load(std::memory_order_relaxed) && !any_fault_.load(std::memory_order_relaxed);
  }
  /// The next order. Costs one atomic load if there is none.
  std::optional<GivenOrder> take();
  std::optional<FaultOrder> next_fault();
  /// True if there is an order, false after the timeout. For a run in virtual time.
  bool wait(std::chrono::milliseconds most);
  /// True if an order that ends the run has been given, taken or not.
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
