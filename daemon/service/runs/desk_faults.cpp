// Faults that somebody lets befall the bench of the run under way.

#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/service/runs/desk_run.hpp"

namespace weft::daemon::control {
namespace {

/// Told once, on the desk's thread, also where nobody ever takes the order up.
class Answer {
 public:
  Answer(std::function<void(std::function<void()>)> post, FaultTold told)
      : post_(std::move(post)), told_(std::move(told)) {}
  ~Answer() {
    if (told_)
      tell(fail({.code = Errc::wrong_state,
                 .where = "/rig",
                 .what = "the run has ended",
                 .hint = "Start another; faults for all of a run are in the rig file, under "
                         "simulation.faults"}));
  }
  Answer(const Answer&) = delete;
  Answer& operator=(const Answer&) = delete;
  void tell(Status done) {
    post_([told = std::exchange(told_, nullptr), done = std::move(done)] { told(done); });
  }

 private:
  std::function<void(std::function<void()>)> post_;
  FaultTold told_;
};

}  // namespace

void RunDesk::befall(FaultOrder order, FaultTold told) {
  const auto at_work =
      std::find_if(runs_.begin(), runs_.end(), [](const auto& run) { return run->at_work; });
  if (at_work == runs_.end())
    return told(fail({.code = Errc::wrong_state,
                      .where = "/rig",
                      .what = "no run is under way, and the bench is there with one only",
                      .hint = "Start one; faults for all of a run are in the rig file, under "
                              "simulation.faults"}));
  Run& run = **at_work;
  const nlohmann::json payload{{"fault", nlohmann::json::parse(order.json)}, {"ends", order.ends}};
  const auto answer = std::make_shared<Answer>(
      around_.post, [this, id = run.view.stored.id(), by = order.by, line = payload.dump(),
                     told = std::move(told)](const Status& done) {
        if (done) note(id, "fault", by, line);
        told(done);
      });
  order.told = [answer](const Status& done) { answer->tell(done); };
  run.orders->give(std::move(order));
}

// Whoever asked for what was not taken up is told as it goes.
void RunDesk::refuse_faults(Run& run) {
  while (run.orders->take_fault()) continue;
}

}  // namespace weft::daemon::control
