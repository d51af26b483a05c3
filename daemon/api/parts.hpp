#pragma once
// Small things that all groups of methods use. For .cpp files of daemon/api.

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "daemon/api/services.hpp"

namespace weft::daemon::api {

/// JSON on one line; text that is not UTF-8 is replaced.
std::string text_of(const nlohmann::json& value);
tl::unexpected<rpc::RpcError> refused(const Error& error);
/// Answers with what `work` returns, which is done on another thread and uses nothing of the
/// server's: a halt waits for none of it. An internal error where it throws; request.too_many where
/// too much waits already.
void answer_apart(const Services::Errand& errand, const rpc::Responder& respond,
                  std::function<rpc::Outcome()> work);
/// check_quickly() of `request` on another thread, then `then` on the server's, which answers: with
/// the call as it was, so that what it needs, a lease, is looked at when it is used.
void check_apart(
    const Services& services, const rpc::Call& call, const rpc::Responder& respond,
    CampaignRequest request,
    std::function<rpc::Outcome(const rpc::Call&, const control::RunDesk::Checked&)> then);
/// "s-41 (ada)": who made a change.
std::string by(const rpc::Caller& caller);

/// Refuses a change to the rig while another user holds its lease.
tl::expected<void, rpc::RpcError> nobody_else_holds(const Services& services,
                                                    const rpc::Caller& caller);
/// The "lease" parameter is the caller's and of this rig.
tl::expected<void, rpc::RpcError> holds_lease(const Services& services, const rpc::Call& call);

/// The "seed" parameter, where there is one. Errors: range, below zero.
Result<std::optional<std::uint64_t>> seed_of(const rpc::Call& call);

/// What run.start and queue.add ask for. Errors: recipe_file()'s, seed_of()'s.
Result<control::RunWish> wish_for_run(const Services& services, const rpc::Call& call);

/// A recipe of the folder by its name, with or without ".json".
/// Errors: invalid_argument (not a plain name), not_found, with a did-you-mean.
Result<std::filesystem::path> recipe_file(const Services& services, const std::string& name);

}  // namespace weft::daemon::api
