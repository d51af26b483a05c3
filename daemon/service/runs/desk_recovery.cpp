// What becomes of a run that the daemon's death interrupted.

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "daemon/base/loop/caught.hpp"
#include "daemon/campaign/recovery.hpp"
#include "daemon/service/runs/desk_run.hpp"

namespace weft::daemon::control {
namespace {

Result<ResumePreview> preview_of(Recovery choice, const CampaignRequest& request,
                                 const StopAsked& stop_asked) {
  switch (choice) {
    case Recovery::resume:
      return preview_resume(request, stop_asked);
    case Recovery::discard:
      return preview_discard(request.out);
    case Recovery::keep_partial:
      return preview_keep_partial(request.out, stop_asked);
  }
  return fail({.code = Errc::invalid_argument, .what = "no such choice"});
}

/// A file that is damaged cannot be marked, and nothing makes a data set of it either. What may be
/// put right keeps the run from being discarded.
Result<CampaignSummary> discarded(const std::filesystem::path& folder, std::string_view by) {
  CampaignSummary out;
  out.outcome = recipes::Outcome::aborted;
  const Status marked = discard_campaign(folder, by);
  if (marked) return out;
  const Errc code = marked.error().code;
  if (code != Errc::corrupt && code != Errc::parse) return pass(marked.error());
  out.error = Error(marked.error()).in("not marked as discarded");
  return out;
}

}  // namespace

Status is_where_it_was(const StoredRun& run) {
  std::error_code unseen;
  const std::filesystem::path campaign = run.folder / campaign_file_name;
  if (run.trials_done == 0 || std::filesystem::exists(campaign, unseen)) return {};
  return fail({.code = Errc::not_found,
               .where = campaign.string(),
               .what = "the campaign of this run is not there any more",
               .hint = "Put its folder back, or discard the run"});
}

std::string_view to_string(Recovery choice) {
  constexpr std::array<std::string_view, 3> names{"resume", "discard", "keep-partial"};
  return names[static_cast<std::size_t>(choice)];
}

std::string RunDesk::way_on(const Run& run) {
  const StoredRun& stored = run.view.stored;
  const bool has_all = stored.has_all() || (run.view.since && run.view.since->complete);
  if (run.state() != RunState::ended || has_all || stored.recovered == "discard" ||
      run.view.trials_done == 0)
    return {};
  const std::string seed = stored.seed ? " --seed " + std::to_string(*stored.seed) : "";
  return "What is left of its campaign: weft run " + stored.recipe.string() + " --rig " +
         stored.rig.string() + " --out " + stored.folder.string() + seed + " --resume";
}

Result<RunDesk::Run*> RunDesk::interrupted(std::string_view id) const {
  Run* const run = find(id);
  if (run == nullptr)
    return fail({.code = Errc::not_found,
                 .where = "/params/run",
                 .what = "no such run",
                 .got = std::string(id)});
  if (run->state() != RunState::interrupted)
    return fail({.code = Errc::wrong_state,
                 .where = "/params/run",
                 .what = "only an interrupted run is recovered",
                 .expected = "interrupted",
                 .got = std::string(to_string(run->state())),
                 .hint = way_on(*run)});
  if (run->settling)
    return fail({.code = Errc::wrong_state,
                 .where = "/params/run",
                 .what = "somebody is about to end this run"});
  return run;
}

// Who asks while somebody looks hears what that one finds.
void RunDesk::preview(std::string_view id, Recovery choice, PreviewTold told) {
  const auto found = interrupted(id);
  if (!found) return told(pass(found.error()));
  Run& run = **found;
  run.curious.push_back({choice, std::move(told)});
  if (run.curious.size() == 1) look(run);
}

void RunDesk::look(Run& run) {
  Result<CampaignRequest> request = request_of(run.view.stored);
  if (request) request->resume = true;
  const Recovery choice = run.curious.front().choice;
  run.looker =
      std::jthread([this, &run, choice, request = std::move(request)](std::stop_token stop) {
        const auto left = caught([&]() -> Result<ResumePreview> {
          if (!request) return pass(request.error());
          return preview_of(choice, *request, [&stop] { return stop.stop_requested(); });
        });
        around_.post([this, &run, choice, left] {
          run.looker.join();  // this was its last word
          for (auto& each : std::exchange(run.curious, {}))
            if (each.choice == choice)
              each.told(left);
            else
              run.curious.push_back(std::move(each));
          if (!run.curious.empty()) look(run);
        });
      });
}

Result<CampaignRequest> RunDesk::request_to_recover(std::string_view id) const {
  const auto found = interrupted(id);
  if (!found) return pass(found.error());
  return request_of((*found)->view.stored);
}

Result<RunView> RunDesk::recover(std::string_view id, std::string_view by) {
  const auto request = request_to_recover(id);
  if (!request) return pass(request.error());
  return recover(id, by, check_quickly(*request));
}

Result<RunView> RunDesk::recover(std::string_view id, std::string_view by, const Checked& checked) {
  if (Status more = takes_more(); !more) return pass(more.error());
  const auto found = interrupted(id);
  if (!found) return pass(found.error());
  Run& run = **found;
  if (!checked) return pass(checked.error());
  if (!run.counted) count_trials(run);  // its folder may be back
  StoredRun stored = run.view.stored;
  if (Status there = is_where_it_was(stored); !there) return pass(there.error());
  stored.resume = true;
  const bool left_rig_so = standing_ == RigStanding{RigStanding::Fact::unknown, stored.id()};
  const RunMachine queued{RunState::queued, RunMachine::Clock::max()};
  if (Status kept = becomes(run, std::move(stored), queued, by); !kept) return pass(kept.error());
  plan_known(run, known_of(checked->plan));
  if (left_rig_so) trusted_ = run.view.stored.id();
  tell(run, by);
  begin_next();
  return shown(run);
}

void RunDesk::settle(std::string_view id, Recovery choice, std::string_view by, SettledTold told) {
  if (Status more = takes_more(); !more) return told(pass(more.error()));
  const auto found = interrupted(id);
  if (!found) return told(pass(found.error()));
  if (Status here = store_.in_place(); !here) return told(pass(here.error()));
  Run& run = **found;
  run.settling = true;
  run.settler = std::jthread([this, &run, choice, told = std::move(told), by = std::string(by),
                              folder = run.view.stored.folder](std::stop_token stop) {
    const auto summary = caught([&]() -> Result<CampaignSummary> {
      if (choice == Recovery::discard) return discarded(folder, by);
      return keep_partial(folder, by, [&stop] { return stop.stop_requested(); });
    });
    around_.post(
        [this, &run, choice, by, summary, told] { settled(run, choice, by, summary, told); });
  });
}

// The rig is as the run left it: settling it has moved nothing. A folder that went away meanwhile
// had no campaign to settle.
void RunDesk::settled(Run& run, Recovery choice, std::string_view by,
                      const Result<CampaignSummary>& summary, const SettledTold& told) {
  run.settler.join();  // this was its last word
  run.settling = false;
  if (!summary) return told(pass(summary.error(), run.view.stored.id()));
  if (Status here = store_.in_place(); !here) return told(pass(here.error()));
  StoredRun& stored = run.view.stored;
  stored.outcome = recipes::to_string(summary->outcome);
  stored.recovered = to_string(choice);
  stored.dataset_sha256 = summary->dataset_sha256;
  stored.error = summary->error ? to_string(*summary->error) : "";
  stored.dataset_error.clear();
  run.view.since.reset();
  run.certified_at.reset();
  if (choice == Recovery::keep_partial) {
    run.view.trials_done = summary->trials_complete;
    run.view.trials_planned = summary->trials_planned;
  }
  const nlohmann::json payload{{"choice", to_string(choice)}};
  note(stored.id(), "recovered", by, payload.dump());
  apply(run, on_ended(), by);
  tell_end(run);
  told(run.view);
}

}  // namespace weft::daemon::control
