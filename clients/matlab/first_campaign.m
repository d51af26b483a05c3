% Runs a campaign on the daemon at WEFT_HTTP and prints the mean count of each fabric. On a simulated bench the results are simulated and do
% not describe real fabrics. For MATLAB and GNU Octave; see README.md.
addpath(fileparts(mfilename('fullpath')));
recipe = getenv('WEFT_RECIPE');
if isempty(recipe)
  recipe = 'first';
end

check = weft_rpc('recipe.check', struct('recipe', recipe));
assert(check.ok, 'recipe %s cannot run on this rig', recipe);
fprintf('%d trials, %.0f minutes of bench time\n', check.plan.trials, check.plan.eta_s / 60);

ttl_ms = 60000;
if ~isempty(getenv('WEFT_LEASE_MS'))
  ttl_ms = str2double(getenv('WEFT_LEASE_MS'));
end
lease = weft_rpc('lease.acquire', struct('ttl_ms', ttl_ms, 'note', 'first_campaign.m'));
run = weft_rpc('run.start', struct('recipe', recipe, 'lease', lease.lease));
ended = weft_wait(run.run, lease.lease, ttl_ms);
fprintf('%s: outcome %s, cleanup %s, rig %s\n', run.run, ended.outcome, ended.cleanup, ended.rig);

told = weft_rpc('data.get', struct('run', run.run));
data = weft_dataset(told.folder);  % on the daemon's machine; on another one GET `told.files(k).path`
names = unique(data.label);
for k = 1:numel(names)
  total = 0;
  values = 0;
  for r = find(data.runs.phase == 'M')'
    if strcmp(data.label{data.runs.trial(r)}, names{k})
      moving = data.counts(data.runs.first(r):data.runs.first(r) + data.runs.samples(r) - 1, :);
      total = total + sum(moving(:));
      values = values + numel(moving);
    end
  end
  fprintf('%-10s %4d trials, mean count in motion %.3f\n', names{k}, sum(strcmp(data.label, names{k})), total / values);
end
