function data = weft_dataset(folder)
% WEFT_DATASET  Reads the data set in the folder of a run (docs/reference/dataset.md, "HDF5 layout" and "Certificate").
%   data.label    cell array with the fabric of each complete trial; from certificate.json, because Octave cannot read strings of HDF5 files
%   data.counts   raw counts [samples x taxels] of all trials in sequence
%   data.runs     sections of one phase: trial, from 1; phase, one of S P M E -; first row, from 1; samples
  file = fullfile(folder, 'dataset.h5');
  if exist('OCTAVE_VERSION', 'builtin')
    h5 = load('-hdf5', file, 'taxel', 'phases');
    counts = h5.taxel.counts;
    runs = h5.phases;
  else
    counts = h5read(file, '/taxel/counts');
    runs = struct('trial', h5read(file, '/phases/trial'), 'phase', h5read(file, '/phases/phase'), ...
                  'first', h5read(file, '/phases/first'), 'samples', h5read(file, '/phases/samples'));
  end
  data.counts = double(counts)';  % both readers return the last dimension first
  data.runs = struct('trial', double(runs.trial(:)) + 1, 'phase', char(runs.phase(:)), ...
                     'first', double(runs.first(:)) + 1, 'samples', double(runs.samples(:)));
  certificate = jsondecode(fileread(fullfile(folder, 'certificate.json')));
  trials = certificate.trials;
  data.label = {};
  for k = 1:numel(trials)
    if strcmp(trials(k).outcome, 'complete')
      named = regexp(trials(k).name, '^\d+-(.*)-[^-]+-r\d+$', 'tokens');  % 0007-denim-M1-r08
      data.label{end + 1, 1} = named{1}{1};
    end
  end
  assert(numel(data.label) == max(data.runs.trial), ...
         'number of trials differs between certificate and data set: %d (expected %d)', numel(data.label), max(data.runs.trial));
end
