# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What the package says about itself holds: metadata, dependencies, entry points, licence."""

import ast
import configparser
import importlib.util
import os
import platform
import re
import runpy
import subprocess
import sys
import tomllib
import types
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / 'poststall_sim'

# Python packages we import: their rosdep key, and their name for pip.
LIBRARIES = {
    'numpy': ('python3-numpy', 'numpy'),
    'scipy': ('python3-scipy', 'scipy'),
    'numba': ('python3-numba', 'numba'),
    'yaml': ('python3-yaml', 'PyYAML'),
    'matplotlib': ('python3-matplotlib', 'matplotlib'),
    'mpl_toolkits': ('python3-matplotlib', 'matplotlib'),
    'tqdm': ('python3-tqdm', 'tqdm'),
    'rosbags': (None, 'rosbags'),
    'threadpoolctl': (None, 'threadpoolctl'),  # has no rosdep key
    'control': (None, 'control'),
    'plotly': (None, 'plotly'),
    'aiohttp': ('python3-aiohttp', 'aiohttp'),
    'shtab': (None, 'shtab'),
    'dask': (None, 'dask'),
    'distributed': (None, 'dask'),
    'pyarrow': (None, 'pyarrow'),
    'xarray': (None, 'xarray'),
    'zarr': (None, 'zarr'),
    'gymnasium': (None, 'gymnasium'),
}
# Used where they are found: a full Jazzy has them, pip has not.
OPTIONAL = {'tf2_msgs', 'simulation_interfaces', 'rosbag2_py'}


@pytest.fixture(scope='module')
def manifest():
    """Return the root element of package.xml."""
    return ElementTree.parse(ROOT / 'package.xml').getroot()


@pytest.fixture(scope='module')
def metadata():
    """Return what setup.py hands to setuptools, which need not be installed for it."""
    caught = {}
    setuptools = types.ModuleType('setuptools')
    setuptools.find_packages = lambda **_: []
    setuptools.setup = caught.update
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        patch.setitem(sys.modules, 'setuptools', setuptools)
        runpy.run_path('setup.py')
    return caught


def repository_files():
    """Return the files that are, or are about to be, in the repository."""
    try:
        listed = subprocess.run(
            ['git', 'ls-files', '-z', '--cached', '--others', '--exclude-standard'],
            cwd=ROOT, check=True, capture_output=True, text=True).stdout.split('\0')
    except (OSError, subprocess.CalledProcessError):  # a copy without git
        listed = [str(path.relative_to(ROOT)) for path in ROOT.rglob('*')
                  if not re.search(r'\.(venv|matrix)/|_cache/|__pycache__|egg-info', str(path))]
    return [ROOT / name for name in listed if name and (ROOT / name).is_file()]


def imported(*folders):
    """Return the top-level names imported below the folders, each with a file that does."""
    found = {}
    for path in [path for folder in folders for path in (ROOT / folder).rglob('*.py')]:
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                names = [node.module]
            else:
                continue
            found.update({name.partition('.')[0]: path.relative_to(ROOT) for name in names})
    ours_or_pythons = sys.stdlib_module_names | {'poststall_sim'}
    return {name: path for name, path in found.items() if name not in ours_or_pythons}


def test_versions_agree(manifest, metadata):
    changelog = re.search(r'^(\d+\.\d+\.\d+) \(', (ROOT / 'CHANGELOG.rst').read_text(), re.M)
    module = re.search(r"^__version__ = '(.*)'$", (PACKAGE / '__init__.py').read_text(), re.M)
    assert {manifest.findtext('version'), metadata['version'],
            changelog.group(1), module.group(1)} == {metadata['version']}


def test_the_citation_is_of_this_version_and_names_the_dissertation(metadata):
    """Keys that the Citation File Format 1.2 asks for, and those of a thesis."""
    citation = yaml.safe_load((ROOT / 'CITATION.cff').read_text(encoding='utf-8'))
    assert {'cff-version', 'message', 'title', 'authors'} <= set(citation)
    assert citation['cff-version'] == '1.2.0' and citation['type'] == 'software'
    assert (citation['title'], citation['version']) == (metadata['name'], metadata['version'])
    assert citation['license'] == metadata['license']
    assert citation['authors'] == [{'name': metadata['maintainer']}]
    thesis, = citation['references']
    assert {'type', 'title', 'authors'} <= set(thesis) and thesis['type'] == 'thesis'
    assert (thesis['authors'][0]['family-names'], thesis['year']) == ('Paul', 2015)


def test_manifest_and_setup_tell_the_same(manifest, metadata):
    assert manifest.get('format') == '3'
    assert manifest.findtext('export/build_type') == 'ament_python'
    assert metadata['name'] == manifest.findtext('name') == 'poststall_sim'
    assert metadata['license'] == manifest.findtext('license') == 'Apache-2.0'
    assert metadata['description'] == ' '.join(manifest.findtext('description').split())
    assert metadata['maintainer'] == manifest.findtext('maintainer')
    assert metadata['maintainer_email'] == manifest.find('maintainer').get('email')


def test_colcon_puts_executables_where_ros2_run_looks():
    config = configparser.ConfigParser()
    config.read(ROOT / 'setup.cfg')
    assert {section: dict(config[section]) for section in config.sections()} == {
        'develop': {'script_dir': '$base/lib/poststall_sim'},
        'install': {'install_scripts': '$base/lib/poststall_sim'},
    }


def test_colcon_test_finds_pytest(metadata):
    # With `tests_require` colcon runs unittest instead, and reports success on no tests.
    assert 'tests_require' not in metadata
    assert any(re.match(r'pytest\b(?!-)', need) for need in metadata['extras_require']['test'])


def test_every_configuration_and_launch_file_is_installed(metadata):
    installed = dict(metadata['data_files'])
    assert installed['share/ament_index/resource_index/packages'] == ['resource/poststall_sim']
    assert 'package.xml' in installed['share/poststall_sim']
    wanted = [path.relative_to(ROOT) for path in repository_files()
              if path.relative_to(ROOT).parts[0] in ('config', 'launch')]
    assert wanted
    for path in wanted:
        assert str(path) in installed.get(f'share/poststall_sim/{path.parent}', []), path


def test_every_file_that_is_no_module_is_packed(metadata):
    packed = {str(PACKAGE.parent / package.replace('.', '/') / name)
              for package, names in metadata['package_data'].items() for name in names}
    found = {str(path) for path in repository_files()
             if PACKAGE in path.parents and path.suffix != '.py'}
    assert packed == found


def test_executables_exist(metadata):
    scripts = metadata['entry_points']['console_scripts']
    assert [script.split(' = ')[0] for script in scripts] == [
        'simulator', 'pilot', 'autopilot', 'poststall']
    for script in scripts:
        module, function = script.split(' = ')[1].split(':')
        source = (ROOT / module.replace('.', '/')).with_suffix('.py').read_text()
        functions = [node.name for node in ast.parse(source).body
                     if isinstance(node, ast.FunctionDef)]
        assert function in functions, script


def test_every_import_is_a_declared_dependency(manifest, metadata):
    rosdep_keys = {element.text for element in manifest.findall('exec_depend')}
    pip_names = {re.match(r'[\w-]+', need).group()
                 for need in metadata['install_requires'] + metadata['extras_require']['all']
                 + metadata['extras_require']['campaign'] + metadata['extras_require']['learning']}
    for name, where in imported('poststall_sim', 'launch').items():
        if name in OPTIONAL:
            continue
        key, pip_name = LIBRARIES.get(name, (name, None))
        assert key in rosdep_keys | {None}, f'{where} imports {name}: not in package.xml'
        assert pip_name in pip_names | {None}, f'{where} imports {name}: not in setup.py'


def test_no_library_is_declared_and_unused(manifest):
    declared = {element.text for element in manifest.findall('exec_depend')
                if element.text.startswith('python3-')}
    assert declared <= {LIBRARIES[name][0] for name in imported('poststall_sim')
                        if name in LIBRARIES}


def test_importing_the_package_imports_nothing():
    tree = ast.parse((PACKAGE / '__init__.py').read_text())
    assert not [node for node in ast.walk(tree) if isinstance(node, ast.Import | ast.ImportFrom)]


def test_core_imports_without_ros_files_or_plots():
    contracts = tomllib.loads((ROOT / 'pyproject.toml').read_text())['tool']['importlinter']
    contract = next(each for each in contracts['contracts'] if each['type'] == 'forbidden')
    modules = []
    for name in contract['source_modules']:
        path = ROOT / name.replace('.', '/')
        files = sorted(path.rglob('*.py')) if path.is_dir() else [path.with_suffix('.py')]
        modules += ['.'.join(file.relative_to(ROOT).with_suffix('').parts)
                    for file in files if file.exists()]
    # numba itself imports logging; the linter sees to ours.
    blocked = set(contract['forbidden_modules']) - {'logging'}
    program = f"""
import importlib
import sys


class Blocker:
    def find_spec(self, name, path=None, target=None):
        if name.partition('.')[0] in {blocked!r}:
            raise ModuleNotFoundError(name + ' is out of reach', name=name)


sys.meta_path.insert(0, Blocker())
for module in {modules!r}:
    importlib.import_module(module)
print(len(sys.modules))
"""
    done = subprocess.run([sys.executable, '-c', program], cwd=ROOT, capture_output=True,
                          text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > len(modules)


def test_every_file_names_its_licence():
    suffixes = {'.py', '.toml', '.cfg', '.yaml', '.yml', '.xml', '.rst', '.md', '.sh', '.csv',
                '.html', '.js'}
    names = {'Makefile', '.gitignore', 'run'}
    without = [str(path.relative_to(ROOT)) for path in repository_files()
               if path.suffix in suffixes or path.name in names
               if not re.search(r'Copyright 2026 the poststall_sim developers.*\n'
                                r'.*SPDX-License-Identifier: Apache-2.0',
                                ''.join(path.read_text().splitlines(keepends=True)[:6]))]
    assert not without


def test_licence_is_apache_2_whole_and_unaltered():
    text = (ROOT / 'LICENSE').read_text()
    assert 'Apache License\n                           Version 2.0, January 2004' in text
    assert len(text.splitlines()) == 202


def test_no_file_names_a_machine():
    # Written so that this file does not find itself.
    home, registries = '/(?:work|root|home)/', ['pypi' + r'\.org', 'python' + 'hosted',
                                                'npm' + r'js\.org', 'deb' + r'\.debian']
    pattern = re.compile('|'.join([rf'(?<![\w.)}}>$-]){home}[\w.]', *registries]))
    found = []
    for path in repository_files():
        try:
            lines = path.read_text().splitlines()
        except UnicodeDecodeError:
            continue  # a figure
        found += [f'{path.relative_to(ROOT)}:{number}: {line.strip()[:80]}'
                  for number, line in enumerate(lines, 1) if pattern.search(line)]
    assert not found


@pytest.mark.skipif(os.name != 'posix', reason='Windows keeps no executable bit')
def test_scripts_are_executable():
    for name in ('.ci/run', 'test/colcon_build.sh'):
        assert os.access(ROOT / name, os.X_OK), name


NOT_FROM_HERE = {'jsbsim', 'rosless', 'launch_ros', 'playwright'}
"""What tests are skipped without and no checkout installs: each says why where it is asked for."""


@pytest.mark.skipif(not Path(sys.prefix).is_relative_to(ROOT),
                    reason='not in a venv that `make` has made, which has all that tests ask for')
def test_no_test_is_skipped_for_want_of_what_is_installed_with_it():
    """Else one library that is gone would silence half the tests, and the rest would pass."""
    asked = {'aiohttp'}   # by name in a loop
    for path in (*(ROOT / 'test').glob('*.py'), *(ROOT / 'benchmark').glob('*.py')):
        asked |= {node.args[0].value for node in ast.walk(ast.parse(path.read_text()))
                  if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)
                  and node.func.attr == 'importorskip' and isinstance(node.args[0], ast.Constant)}
    asked = {name for name in asked if name.partition('.')[0] not in NOT_FROM_HERE}
    if (sys.platform, platform.machine()) != ('linux', 'x86_64'):
        asked.discard('cyclonedds')   # has wheels there alone
    assert {'rclpy', 'rosbags', 'matplotlib', 'distributed', 'gymnasium'} < asked
    assert [name for name in sorted(asked) if importlib.util.find_spec(name) is None] == []
