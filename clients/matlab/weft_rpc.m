function result = weft_rpc(method, params)
% WEFT_RPC  Calls a method of weftd's API by POST /rpc (docs/reference/api.md).
%   RESULT = WEFT_RPC(METHOD, PARAMS): PARAMS is a struct (default: empty), RESULT a struct.
%   WEFT_HTTP is the address of the daemon, "http://127.0.0.1:8080"; WEFT_TOKEN is the token.
%   Errors: weft:KIND for an error of the daemon, such as weft:param_unknown; weft:connection.
  if nargin < 2
    params = struct();
  end
  request = struct('jsonrpc', '2.0', 'id', 1, 'method', method, 'params', params);
  folder = tempname();
  mkdir(folder);
  system(sprintf('chmod 700 "%s"', folder));  % before the token is written there
  body = fullfile(folder, 'request.json');
  headers = fullfile(folder, 'headers');  % not on the command line: every user can list the arguments of processes
  write_text(body, jsonencode(request));
  write_text(headers, sprintf('Authorization: Bearer %s\nContent-Type: application/json\n', getenv('WEFT_TOKEN')));
  [status, text] = system(sprintf('curl -sS -H "@%s" --data-binary "@%s" "%s/rpc"', headers, body, getenv('WEFT_HTTP')));
  delete(body);
  delete(headers);
  rmdir(folder);
  if status ~= 0
    error('weft:connection', '%s: daemon not reachable: %s', getenv('WEFT_HTTP'), text);
  end
  answer = jsondecode(text);
  if isfield(answer, 'error')
    error(['weft:' strrep(answer.error.data.kind, '.', '_')], '%s: %s', method, answer.error.message);
  end
  result = answer.result;
end

function write_text(name, text)
  file = fopen(name, 'w');
  fwrite(file, text);
  fclose(file);
end
