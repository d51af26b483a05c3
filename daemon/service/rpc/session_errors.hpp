#pragma once
// What a conversation refuses, as errors of docs/api.md.

#include <cstddef>
#include <string>
#include <string_view>

#include "daemon/service/rpc/idempotency.hpp"
#include "daemon/service/rpc/role.hpp"
#include "daemon/service/rpc/rpc_error.hpp"

namespace weft::daemon::server {

rpc::RpcError role_too_low(access::Role has, access::Role needs, std::string_view method);
rpc::RpcError key_in_use(access::IdempotencyCache::Found found, const std::string& key);
rpc::RpcError answer_too_long(std::size_t bytes);
rpc::RpcError requests_too_fast(std::string_view user);

}  // namespace weft::daemon::server
