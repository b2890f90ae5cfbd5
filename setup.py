# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The package's only metadata, read by colcon and by pip."""

import os
from glob import glob

from setuptools import find_packages, setup

package_name = 'poststall_sim'


def shared(pattern):
    """Pair each folder with its files that match `pattern`, as `data_files` takes them."""
    folders = {}
    for path in sorted(glob(pattern, recursive=True)):
        if os.path.isfile(path):
            folders.setdefault(os.path.dirname(path), []).append(path)
    return [(os.path.join('share', package_name, folder), files)
            for folder, files in folders.items()]


# rclpy and the messages are an extra, not a requirement: on an installed ROS 2 they come
# from package.xml, and the core, the command line and its bags do without them.
extras = {
    'ros': [
        'ros-jazzy-rclpy[fastrtps]',
        'ros-jazzy-common-interfaces',
        'ros-jazzy-rosgraph-msgs',
    ],
    'record': ['rosbags>=0.11'],
    'plot': ['matplotlib>=3.6'],
    'report': ['plotly>=5.15'],
    'watch': ['aiohttp>=3.9', 'plotly>=5.15'],
    'progress': ['tqdm>=4.64'],
    'threads': ['threadpoolctl>=3.1'],
    'control': ['control>=0.9.4'],
    'completion': ['shtab>=1.7'],
}
extras['all'] = sorted(set(sum(extras.values(), [])))
# Not in `all`: it brings CasADi and pandas, 300 MB, and only tools/make_polars.py asks for it.
extras['polars'] = ['neuralfoil>=0.3']
# Nor these: the first is 350 MB, and one flight needs none of it.
# pyarrow 26 wants NumPy 2 and does not tell pip, which then puts it beside NumPy 1.26.
extras['campaign'] = ['dask[distributed]>=2024.1', 'pyarrow>=14,<26', 'xarray>=2024.1',
                      'zarr>=2.16']
extras['learning'] = ['gymnasium>=1.1']
extras['test'] = [
    *extras['campaign'],
    *extras['learning'],
    'hypothesis',
    'pytest>=7.4',
    'pytest-benchmark',
    'pytest-timeout',
    'pytest-xdist',
    *extras['completion'],
    # A second DDS, to talk to the nodes, where it has wheels; elsewhere its test is skipped.
    'cyclonedds>=11,<12; sys_platform == "linux" and platform_machine == "x86_64"',
]
# Drives a Chromium that is installed already, to test the pages; not in `test`, for its size.
extras['browser'] = ['playwright>=1.40']
# The site. MathJax comes along with the last, so that no page asks the network.
extras['docs'] = [
    'sphinx>=7.2',
    'myst-parser>=3',
    'furo',
    'sphinx-copybutton',
    'sphinx-mathjax-offline',
]
# ruff's minor versions change what the selected rules report.
extras['lint'] = ['import-linter>=2.1', 'ruff>=0.17,<0.18']

setup(
    name=package_name,
    version='0.1.0',
    packages=find_packages(include=[package_name, package_name + '.*']),
    package_data={package_name + '.report': ['page.html', 'page.js', 'figures.js'],
                  package_name + '.watch': ['live.html', 'live.css', 'live.js', 'aircraft.js']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/' + package_name]),
        ('share/' + package_name, ['package.xml']),
        *shared('launch/*.launch.py'),
        *shared('config/**'),
    ],
    python_requires='>=3.11,<3.13',
    # The lower ends are those of Ubuntu 24.04, where ROS 2 Jazzy lives.
    install_requires=[
        'numpy>=1.26',
        'scipy>=1.11',
        'numba>=0.58',
        'PyYAML>=6.0',
    ],
    extras_require=extras,
    zip_safe=False,
    maintainer='the poststall_sim developers',
    maintainer_email='maintainers@poststall-sim.example',
    description='ROS 2 flight simulation beyond the stall, on an unsteady vortex lattice '
                'corrected by decambering.',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'simulator = poststall_sim.ros.simulator:main',
            'pilot = poststall_sim.ros.pilot:main',
            'autopilot = poststall_sim.ros.autopilot:main',
            'poststall = poststall_sim.__main__:main',
        ],
    },
)
