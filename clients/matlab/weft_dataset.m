function data = weft_dataset(folder)
% WEFT_DATASET  What the data set of a run's folder has (docs/reference/dataset.md, "HDF5 layout" and "Certificate").
%   data.label    cell array of the fabrics' names, one a complete trial; from certificate.json, as Octave does not read texts of HDF5 files
%   data.counts   raw counts [samples x taxels], all trials one behind the other
%   data.runs     where phases are: trial, from 1; phase, a letter of S P M E -; first row, from 1; samples
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
  data.counts = double(counts)';  % both have the last dimension first
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
  assert(numel(data.label) == max(data.runs.trial), 'certificate and data set disagree on the number of trials');
end
