function ended = weft_wait(run, lease, ttl_ms)
% WEFT_WAIT  A run's last state, once it is over; the lease is renewed at a third of its time until then.
%   A lease that is lost is a warning: what runs goes on. Each wait for an answer is a short one, so that a campaign may last as long as it likes.
  kept = true;
  while true
    begun = tic();
    if kept
      try
        weft_rpc('lease.renew', struct('lease', lease, 'ttl_ms', ttl_ms));
      catch refused
        kept = false;
        warning('weft:lease', 'the lease is lost, what runs goes on: %s', refused.message);
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
      warning('weft:lease', 'the lease was lost: %s', refused.message);
    end
  end
end
