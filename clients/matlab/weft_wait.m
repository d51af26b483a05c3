function ended = weft_wait(run, lease, ttl_ms)
% WEFT_WAIT  Waits for the end of a run and returns its last state. Renews the lease after a third of its time, and releases it at the end.
%   Warns (weft:lease) if the lease is lost; the run continues. Each request is short, so that no timeout limits the duration of the run.
  kept = true;
  while true
    begun = tic();
    if kept
      try
        weft_rpc('lease.renew', struct('lease', lease, 'ttl_ms', ttl_ms));
      catch refused
        kept = false;
        warning('weft:lease', 'lease lost, the run continues: %s', refused.message);
      end
    end
    ended = weft_rpc('run.get', struct('run', run));
    if any(strcmp(ended.state, {'ended', 'interrupted'}))
      break
    end
    pause(max(0, min(ttl_ms / 3000, 5) - toc(begun)));
  end
  if kept
    try
      weft_rpc('lease.release', struct('lease', lease));
    catch refused
      warning('weft:lease', 'lease not released: %s', refused.message);
    end
  end
end
