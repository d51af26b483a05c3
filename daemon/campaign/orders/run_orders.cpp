#include "daemon/campaign/orders/run_orders.hpp"

namespace weft::daemon {

std::string_view to_string(Order order) {
  switch (order) {
    case Order::pause:
      return "pause";
    case Order::pause_now:
      return "pause now";
    case Order::resume:
      return "resume";
    case Order::confirm:
      return "confirm";
    case Order::stop:
      return "stop";
    case Order::abort:
      return "abort";
    case Order::halt:
      return "halt";
  }
  return "unknown";
}

recipes::Event event_of(const GivenOrder& given) {
  switch (given.order) {
    case Order::pause:
      return recipes::PauseRequested{false};
    case Order::pause_now:
      return recipes::PauseRequested{true};
    case Order::resume:
      return recipes::ResumeRequested{};
    case Order::confirm:
      return recipes::OperatorConfirmed{given.confirms};
    case Order::stop:
      return recipes::StopRequested{};
    case Order::abort:
      return recipes::AbortRequested{};
    case Order::halt:
      return recipes::HaltRequested{};
  }
  return recipes::HaltRequested{};
}

void RunOrders::give(GivenOrder order) {
  const std::lock_guard lock(mutex_);
  if (order.order >= Order::stop) ends_ = true;
  if (order.order == Order::halt)
    waiting_.push_front(std::move(order));  // before all others
  else
    waiting_.push_back(std::move(order));
  any_ = true;
  arrived_.notify_all();
}

void RunOrders::give(FaultOrder order) {
  const std::lock_guard lock(mutex_);
  faults_.push_back(std::move(order));
  any_fault_ = true;
}

std::optional<FaultOrder> RunOrders::next_fault() {
  if (!any_fault_.load(std::memory_order_relaxed)) return std::nullopt;
  const std::lock_guard lock(mutex_);
  FaultOrder first = std::move(faults_.front());
  faults_.pop_front();
  any_fault_ = !faults_.empty();
  return first;
}

std::optional<GivenOrder> RunOrders::take() {
  if (!any_.load(std::memory_order_relaxed)) return std::nullopt;
  const std::lock_guard lock(mutex_);
  GivenOrder first = std::move(waiting_.front());
  waiting_.pop_front();
  any_ = !waiting_.empty();
  return first;
}

bool RunOrders::wait(std::chrono::milliseconds most) {
  std::unique_lock lock(mutex_);
  return arrived_.wait_for(lock, most, [this] { return !waiting_.empty(); });
}

}  // namespace weft::daemon
