!> Scenes drawn at random from the table of names: each number over its whole range, its ends, its default, special
!> values and their neighbours, and, half of the time, where beams live. What makes a run long is kept small.
module scene_drawing
   use kinds, only: lambda1_power4, wp
   use load_settings, only: base_displacement, course_table, start_names, start_release, time_course_t
   use number_text, only: to_text
   use random_numbers, only: next_random, random_t, start_random
   use run_settings, only: body_settings_t, side_above, side_both, stop_settings_t
   use scene_draft, only: draft_t, drop, has_name, number_of, put, value_of
   use scene_names, only: kind_logical, kind_number, kind_text, kind_words, name_t
   use scene_types, only: scene_t, support_rotation
   implicit none (type, external)
   private
   public :: draw_scene, draw_steps, bound_periods, give_units, take_ratios, place_of_parameter, table_file

   !> What the names of the contacts of bodies with the beam, and with floor and ceiling, begin with.
   character(*), parameter :: floors(2) = [character(6) :: '', 'floor_']

   !> A table of loads that stands beside the scene.
   character(*), parameter :: table_file = 'loads.txt'

   !> Where a number mostly lies, and the most of it that a scene here can afford.
   type :: usual_t
      character(24) :: group
      character(32) :: name
      real(wp) :: least
      real(wp) :: most
      logical :: is_logarithmic
      real(wp) :: affordable = huge(1.0_wp)
   end type usual_t

   type(usual_t), parameter :: usual(*) = [ &
      usual_t('beam', 'taper', -0.15_wp, 0.15_wp, .false.), usual_t('beam', 'length', 0.5_wp, 2.0_wp, .false.), &
      usual_t('beam', 'width', 0.1_wp, 2.0_wp, .true.), usual_t('beam', 'height_root', 0.03_wp, 0.15_wp, .false.), &
      usual_t('beam', 'height_tip', 0.03_wp, 0.15_wp, .false.), &
      usual_t('beam', 'youngs_modulus', 0.1_wp, 10.0_wp, .true.), usual_t('beam', 'density', 0.1_wp, 10.0_wp, .true.), &
      usual_t('section', 'width', 0.1_wp, 1.0_wp, .true.), usual_t('section', 'height', 0.03_wp, 0.1_wp, .false.), &
      usual_t('section', 'diameter', 0.03_wp, 0.1_wp, .false.), usual_t('section', 'wall', 1.0e-3_wp, 0.02_wp, .true.), &
      usual_t('section', 'outer_diameter', 0.05_wp, 0.1_wp, .false.), &
      usual_t('section', 'inner_diameter', 0.005_wp, 0.04_wp, .false.), &
      usual_t('mesh', 'elements', 1.0_wp, 16.0_wp, .true., 40.0_wp), usual_t('mesh', 'ratio', 0.8_wp, 1.4_wp, &
      .false.), usual_t('mesh', 'tolerance', 1.0e-4_wp, 1.0e-2_wp, .true., 1.0e-2_wp), &
      usual_t('damping', 'zeta', 1.0e-5_wp, 0.3_wp, .true.), usual_t('tip_mass', 'ratio', 0.01_wp, 5.0_wp, .true.), &
      usual_t('support_1', 'position', 0.1_wp, 1.0_wp, .false.), &
      usual_t('support_1', 'stiffness_ratio', 0.1_wp, 1.0e5_wp, .true.), &
      usual_t('mass_1', 'position', 0.1_wp, 1.0_wp, .false.), &
      usual_t('mass_1', 'mass_ratio', 0.01_wp, 5.0_wp, .true.), &
      usual_t('mass_1', 'rotary_inertia_ratio', 1.0e-4_wp, 0.1_wp, .true.), &
      usual_t('root', 'rotation_stiffness_ratio', 0.01_wp, 1.0e4_wp, .true.), &
      usual_t('root', 'translation_stiffness_ratio', 0.1_wp, 1.0e5_wp, .true.), &
      usual_t('body_1', 'position', 0.2_wp, 1.0_wp, .false.), usual_t('body_1', 'mass_ratio', 0.003_wp, 3.0_wp, .true.), &
      usual_t('body_1', 'clearance_ratio', 0.05_wp, 1.0_wp, .false.), &
      usual_t('body_1', 'spring_ratio', 0.3_wp, 1.0e3_wp, .true.), &
      usual_t('body_1', 'damping_ratio', 0.01_wp, 4.0_wp, .true.), &
      usual_t('body_1', 'base_damper_ratio', 1.0e-3_wp, 10.0_wp, .true.), &
      usual_t('body_1', 'rest_ratio', -0.5_wp, 0.5_wp, .false.), &
      usual_t('body_1', 'start_velocity_ratio', -2.0_wp, 2.0_wp, .false.), &
      usual_t('body_1', 'start_gap_ratio', 0.0_wp, 0.6_wp, .false.), &
      usual_t('body_1', 'floor_ratio', 0.0_wp, 1.0_wp, .false.), usual_t('body_1', 'ceiling_ratio', 0.0_wp, 1.0_wp, .false.), &
      usual_t('body_1', 'restitution', 0.0_wp, 1.0_wp, .false.), &
      usual_t('body_1', 'stiffness_ratio', 1.0_wp, 1.0e4_wp, .true.), &
      usual_t('body_1', 'branch_ratio', 0.01_wp, 100.0_wp, .true.), &
      usual_t('body_1', 'damper_ratio', 1.0e-3_wp, 100.0_wp, .true.), &
      usual_t('stop', 'clearance_ratio', 0.5_wp, 3.0_wp, .false.), &
      usual_t('stop', 'position', 0.3_wp, 1.0_wp, .false.), usual_t('stop', 'preload', -1.5_wp, 2.0_wp, .false.), &
      usual_t('stop', 'restitution', 0.0_wp, 1.0_wp, .false.), &
      usual_t('stop', 'stiffness_ratio', 1.0_wp, 1.0e6_wp, .true.), &
      usual_t('stop', 'branch_ratio', 0.01_wp, 1.0e3_wp, .true.), &
      usual_t('stop', 'damper_ratio', 1.0e-3_wp, 1.0e3_wp, .true.), &
      usual_t('damping', 'zeta_mass', 1.0e-5_wp, 0.3_wp, .true.), usual_t('damping', 'mode_ratios', 1.0e-5_wp, &
      0.3_wp, .true.), usual_t('force_1', 'amplitude_ratio', 0.01_wp, 10.0_wp, .true.), &
      usual_t('force_1', 'frequency_ratio', 0.1_wp, 30.0_wp, .true., 100.0_wp), &
      usual_t('force_1', 'phase', -180.0_wp, 180.0_wp, .false.), &
      usual_t('force_1', 'start', 0.0_wp, 10.0_wp, .false.), usual_t('force_1', 'end', 1.0_wp, 40.0_wp, .true.), &
      usual_t('force_1', 'duration', 0.01_wp, 10.0_wp, .true.), &
      usual_t('base_1', 'gravity_ratio', 0.01_wp, 10.0_wp, .true.), &
      usual_t('base_1', 'amplitude_ratio', 0.01_wp, 10.0_wp, .true.), &
      usual_t('base_1', 'frequency_ratio', 0.1_wp, 30.0_wp, .true., 100.0_wp), &
      usual_t('base_1', 'phase', -180.0_wp, 180.0_wp, .false.), &
      usual_t('base_1', 'start', 0.0_wp, 10.0_wp, .false.), usual_t('base_1', 'end', 1.0_wp, 40.0_wp, .true.), &
      usual_t('base_1', 'duration', 0.01_wp, 10.0_wp, .true.), &
      usual_t('start', 'velocity_ratio', 0.1_wp, 3.0_wp, .true.), &
      usual_t('start', 'displacement_ratio', -2.0_wp, 2.0_wp, .false.), &
      usual_t('start', 'height_ratio', 0.1_wp, 3.0_wp, .true.), usual_t('start', 'mode', 1.0_wp, 4.0_wp, .false.), &
      usual_t('response', 'modes', 1.0_wp, 12.0_wp, .true.), &
      usual_t('response', 'duration', 0.5_wp, 40.0_wp, .true., 60.0_wp), &
      usual_t('response', 'hop_tolerance', 1.0e-10_wp, 1.0e-2_wp, .true.), &
      usual_t('response', 'event_limit', 10.0_wp, 3000.0_wp, .true., 3000.0_wp), &
      usual_t('response', 'contact_tolerance', 1.0e-6_wp, 1.0e-2_wp, .true.), &
      usual_t('response', 'release_tolerance', 1.0e-4_wp, 1.0_wp, .true.), &
      usual_t('response', 'mode_tolerance', 1.0e-12_wp, 1.0e-2_wp, .true.), &
      usual_t('response', 'accuracy', 1.0e-8_wp, 1.0e-2_wp, .true.), &
      usual_t('frequencies', 'count', 1.0_wp, 12.0_wp, .false., 40.0_wp), &
      usual_t('frequencies', 'mesh_elements', 1.0_wp, 40.0_wp, .true., 60.0_wp), &
      usual_t('frequencies', 'mesh_ratios', 0.8_wp, 1.4_wp, .false.), usual_t('output', 'mode_shapes', 0.0_wp, &
      4.0_wp, .false.), &
      usual_t('precision', 'duration', 0.1_wp, 4.0_wp, .true., 4.0_wp), usual_t('precision', 'steps', 0.01_wp, &
      0.1_wp, .true.), &
      usual_t('precision', 'mesh_elements', 1.0_wp, 12.0_wp, .true., 12.0_wp), &
      usual_t('precision', 'scaling_elements', 1.0_wp, 64.0_wp, .true., 64.0_wp), &
      usual_t('precision', 'scaling_modes', 1.0_wp, 6.0_wp, .false., 6.0_wp), &
      usual_t('precision', 'scaling_durations', 0.1_wp, 4.0_wp, .true., 4.0_wp), &
      usual_t('precision', 'repetitions', 1.0_wp, 2.0_wp, .false., 2.0_wp), &
      usual_t('precision', 'shortest_timing', 1.0e-4_wp, 1.0e-3_wp, .true., 1.0e-3_wp), &
      usual_t('statements', 'elements', 1.0_wp, 8.0_wp, .false., 8.0_wp), &
      usual_t('statements', 'fine_elements', 1.0_wp, 12.0_wp, .false., 12.0_wp), &
      usual_t('statements', 'duration', 1.0_wp, 10.0_wp, .false., 10.0_wp), &
      usual_t('sweep', 'count', 1.0_wp, 8.0_wp, .false., 8.0_wp), &
      usual_t('best', 'evaluations', 1.0_wp, 30.0_wp, .false., 30.0_wp)]

   !> The generator of the scene at hand
   type(random_t), save :: random

contains

   !> Scene number `seed`, not yet read: what contradicts itself the reader will say.
   subroutine draw_scene(names, seed, draft, swept)
      !> The table of names
      type(name_t), intent(in) :: names(:)
      !> Which scene
      integer, intent(in) :: seed
      !> The scene
      type(draft_t), intent(out) :: draft
      !> Place of a name of &sweep that it shall have; missing: any scene
      integer, intent(in), optional :: swept

      real(wp) :: choice

      call start_random(seed, 0, random)
      call draw_group(names, 'scene', 0.2_wp, draft)
      if (has_name(draft, 'scene', 'name')) call put(draft, 'scene', 'name', '''a_scene''')
      call draw_group(names, 'mesh', 0.7_wp, draft)
      ! meshes that are compared make a run cost as much as ten
      if (chance(0.8_wp)) call drop(draft, 'mesh', 'tolerance')
      if (chance(0.8_wp)) call drop(draft, 'mesh', 'estimate')
      if (has_name(draft, 'mesh', 'tolerance')) call drop(draft, 'mesh', 'elements')
      if (has_name(draft, 'mesh', 'estimate') .and. has_name(draft, 'mesh', 'elements')) then
         call put(draft, 'mesh', 'elements', to_text(1 + int(8.0_wp*number())))
      end if
      call draw_group(names, 'damping', 0.7_wp, draft)
      call draw_group(names, 'tip_mass', 0.4_wp, draft)
      call draw_beam(names, draft)
      call drop(draft, 'mesh', 'nodes')
      if (chance(0.1_wp)) call draw_nodes(draft)
      if (chance(0.3_wp)) call draw_body(names, draft)
      if (chance(0.15_wp)) call draw_section(draft)
      choice = number()
      if (present(swept)) choice = 0.7_wp
      if (choice < 0.95_wp) then
         call put(draft, 'stop', '', '')
         call draw_group(names, 'stop', 0.6_wp, draft)
         if (chance(0.8_wp)) call drop(draft, 'stop', 'side')
         if (chance(0.4_wp)) call draw_others(names, draft)
         call draw_response(names, draft)
         if (chance(0.3_wp)) call draw_loads(names, draft)
         call bound_periods(draft)
         if (chance(0.25_wp)) call draw_statistics(names, draft)
         ! each of them is little used
         if (chance(0.9_wp)) call drop(draft, 'response', 'modes')
         if (chance(0.7_wp)) call drop(draft, 'damping', 'zeta_mass')
         if (chance(0.8_wp)) call drop(draft, 'damping', 'mode_ratios')
      end if
      if (choice < 0.70_wp) then
         call draw_group(names, 'output', 0.4_wp, draft)
         call draw_instants(draft)
         if (chance(0.15_wp)) call draw_group(names, 'frequencies', 0.5_wp, draft)
      else if (choice < 0.85_wp) then
         ! a case by itself may find another mesh than all that share its beam
         call drop(draft, 'mesh', 'tolerance')
         call draw_sweep(names, draft, swept)
      else if (choice < 0.95_wp) then
         call drop(draft, 'mesh', 'tolerance')
         call draw_cases(names, draft)
         if (chance(0.5_wp)) call draw_group(names, 'output', 0.4_wp, draft)
      else if (choice < 0.99_wp) then
         call put(draft, 'frequencies', '', '')
         call draw_group(names, 'frequencies', 0.5_wp, draft)
         call draw_group(names, 'output', 0.3_wp, draft)
         if (chance(0.3_wp)) call draw_large_meshes(draft)
      else if (choice < 0.995_wp) then
         if (chance(0.7_wp)) call draw_group(names, 'stop', 0.5_wp, draft)
         if (chance(0.5_wp)) call draw_group(names, 'frequencies', 0.5_wp, draft)
         call draw_group(names, 'precision', 0.5_wp, draft)
         ! it knows no limit of events
         if (has_name(draft, 'mesh', 'elements')) call put(draft, 'mesh', 'elements', to_text(1 + int(16.0_wp*number())))
         call put(draft, 'precision', 'duration', to_text(1.0_wp + number()))
         ! millions of steps take as long as all other scenes, and explicit ones are short on uneven meshes and stiff springs
         call drop(draft, 'mesh', 'ratio')
         call drop(draft, 'mesh', 'nodes')
         call drop(draft, 'root', 'rotation_stiffness_ratio')
         call drop(draft, 'root', 'translation_stiffness_ratio')
         if (has_name(draft, 'precision', 'steps')) call put(draft, 'precision', 'steps', to_text(0.01_wp + 0.1_wp*number()))
         call put(draft, 'precision', 'repetitions', to_text(1 + int(2.0_wp*number())))
         call put(draft, 'precision', 'shortest_timing', '1e-4')
      else
         draft%count = 0
         call draw_group(names, 'statements', 1.0_wp, draft)
         return
      end if
      if (choice < 0.95_wp .and. chance(0.25_wp)) then
         call put(draft, 'stress', '', '')
         call draw_group(names, 'stress', 0.5_wp, draft)
         ! all turning points are found, of which fast modes have millions
         if (has_name(draft, 'stress', 'fatigue_slope') .and. has_name(draft, 'stress', 'fatigue_threshold_ratio')) then
            call put(draft, 'response', 'modes', '2')
            call drop(draft, 'mesh', 'tolerance')
         else if (.not. has_name(draft, 'response', 'modes')) then
            call drop(draft, 'stress', 'fatigue_slope')
            call drop(draft, 'stress', 'fatigue_threshold_ratio')
            call drop(draft, 'stress', 'fatigue_threshold')
            call drop(draft, 'stress', 'fatigue_classes')
         end if
         ! the number of modes may be refused, and dropped
         if (has_name(draft, 'stress', 'fatigue_limit')) &
            call put(draft, 'stress', 'fatigue_limit', to_text(int(between(1.0_wp, 1.0e5_wp, .true.))))
         ! extremes are searched while the beam oscillates
         call drop(draft, 'response', 'duration_time')
         call drop(draft, 'response', 'step_time')
         call put(draft, 'response', 'duration', to_text(between(0.5_wp, 40.0_wp, .true.)))
         call put(draft, 'response', 'step', to_text(between(0.01_wp, 0.5_wp, .true.)))
         ! steps of a much shorter run before would record millions of shapes
         if (has_name(draft, 'output', 'shape_step')) call put(draft, 'output', 'shape_step', &
            to_text(number_of(draft, 'response', 'duration')/7.0_wp))
      end if
      if (choice < 0.95_wp) call draw_poincare(names, draft)
      if (choice < 0.95_wp .and. chance(0.3_wp)) call draw_orbit(names, draft)
      if (choice < 0.95_wp .and. chance(0.3_wp)) call draw_spectrum(names, draft)
      if (choice < 0.95_wp .and. chance(0.3_wp)) then
         call put(draft, 'relay', '', '')
         call draw_group(names, 'relay', 0.7_wp, draft)
      end if
      if (choice < 0.95_wp .and. chance(share_of_bodies())) call draw_bodies(names, draft)
   end subroutine draw_scene

   !> Share of scenes that have bodies: a tenth, or IMPACTBEAM_RANDOM_BODIES per cent.
   function share_of_bodies() result(share)
      real(wp) :: share

      character(12) :: text
      integer :: code

      share = 10.0_wp
      call get_environment_variable('IMPACTBEAM_RANDOM_BODIES', text, status=code)
      if (code == 0) read (text, *) share
      share = 0.01_wp*share
   end function share_of_bodies

   !> Bodies, which may take the place of the stops: half of them with usual values, the others with all that is allowed.
   subroutine draw_bodies(names, draft)
      !> The table of names
      type(name_t), intent(in) :: names(:)
      !> The scene
      type(draft_t), intent(inout) :: draft

      character(*), parameter :: sides(3) = [character(7) :: '''below''', '''above''', '''both''']
      character(:), allocatable :: group
      integer :: k

      if (chance(0.5_wp)) call drop_stops(draft)
      do k = 1, 1 + int(3.0_wp*number())
         group = 'body_'//to_text(k)
         if (chance(0.5_wp)) then
            call put_usual('mass_ratio', 1.0_wp)
            call draw_group(names, 'body_1', 0.4_wp, draft, group)
            cycle
         end if
         call put(draft, group, 'side', trim(sides(1 + int(3.0_wp*number()))))
         call put_usual('position', 0.7_wp)
         call put_usual('mass_ratio', 1.0_wp)
         call put_usual('clearance_ratio', merge(1.0_wp, 0.8_wp, value_of(draft, group, 'side') == sides(3)))
         if (chance(0.5_wp)) then
            call put_usual('spring_ratio', 1.0_wp)
            call put_usual('damping_ratio', 0.5_wp)
            call put_usual('rest_ratio', 0.4_wp)
         else
            call put_usual('base_damper_ratio', 0.3_wp)
         end if
         call put_usual('start_velocity_ratio', 0.5_wp)
         call put_usual('start_gap_ratio', 0.4_wp)
         call draw_law('')
         call put_usual('floor_ratio', 0.4_wp)
         call put_usual('ceiling_ratio', 0.3_wp)
         if (has_name(draft, group, 'floor_ratio') .or. has_name(draft, group, 'ceiling_ratio')) call draw_law('floor_')
      end do

   contains

      !> A law of the contacts with the beam, or with floor and ceiling.
      subroutine draw_law(prefix)
         character(*), intent(in) :: prefix

         real(wp) :: choice

         choice = number()
         if (choice < 0.5_wp) then
            call put_usual('restitution', 0.8_wp, prefix)
            return
         end if
         call put(draft, group, prefix//'law', trim(merge('''spring_damper''', '''three_element''', choice < 0.75_wp)))
         call put_usual('stiffness_ratio', 1.0_wp, prefix)
         call put_usual('damper_ratio', 0.7_wp, prefix)
         if (choice >= 0.75_wp) call put_usual('branch_ratio', 0.6_wp, prefix)
      end subroutine draw_law

      !> A usual value, with some probability.
      subroutine put_usual(name, probability, prefix)
         character(*), intent(in) :: name
         real(wp), intent(in) :: probability
         !> The name in the scene begins with it
         character(*), intent(in), optional :: prefix

         character(:), allocatable :: place
         integer :: k

         if (.not. chance(probability)) return
         place = name
         if (present(prefix)) place = prefix//name
         k = findloc(usual%group == 'body_1' .and. usual%name == name, .true., dim=1)
         call put(draft, group, place, to_text(between(usual(k)%least, usual(k)%most, usual(k)%is_logarithmic)))
      end subroutine put_usual
   end subroutine draw_bodies

   !> &spectrum of a part of the run, mostly, at a few frequencies.
   subroutine draw_spectrum(names, draft)
      !> The table of names
      type(name_t), intent(in) :: names(:)
      !> The scene
      type(draft_t), intent(inout) :: draft

      character(*), parameter :: in_units(4) = [character(15) :: 'frequency_range', 'resolution', 'start_time', 'end_time']
      real(wp) :: duration, greatest
      integer :: i

      call put(draft, 'spectrum', '', '')
      call draw_group(names, 'spectrum', 0.5_wp, draft)
      do i = 1, size(in_units)
         call drop(draft, 'spectrum', trim(in_units(i)))
      end do
      duration = 20.0_wp
      if (has_name(draft, 'response', 'duration')) duration = number_of(draft, 'response', 'duration')
      ! samples of long runs at high frequencies would be too many
      greatest = min(between(0.1_wp, 1000.0_wp, .true.), 2.0e4_wp/duration)
      call put(draft, 'spectrum', 'frequency_ratio_range', list([merge(0.0_wp, 0.5_wp*number()*greatest, chance(0.3_wp)), &
         greatest]))
      call drop(draft, 'spectrum', 'resolution_ratio')
      call drop(draft, 'spectrum', 'points')
      if (greatest*duration > 300.0_wp .or. chance(0.5_wp)) then
         call put(draft, 'spectrum', 'points', to_text(2 + int(50.0_wp*number())))
      else if (chance(0.5_wp)) then
         call put(draft, 'spectrum', 'resolution_ratio', to_text(greatest*between(0.01_wp, 2.0_wp, .true.)))
      end if
      if (has_name(draft, 'spectrum', 'contact')) call put(draft, 'spectrum', 'contact', to_text(int(2.0_wp*number())))
      if (has_name(draft, 'spectrum', 'point')) call put(draft, 'spectrum', 'point', '1')
      if (has_name(draft, 'spectrum', 'segments')) call put(draft, 'spectrum', 'segments', to_text(1 + int(20.0_wp*number())))
      if (has_name(draft, 'spectrum', 'start')) call put(draft, 'spectrum', 'start', to_text(0.5_wp*duration*number()))
      if (has_name(draft, 'spectrum', 'end')) call put(draft, 'spectrum', 'end', to_text(duration*(0.6_wp + 0.4_wp*number())))
      if (has_name(draft, 'spectrum', 'closed_form_limit')) call put(draft, 'spectrum', 'closed_form_limit', &
         to_text(10.0_wp**(8.0_wp*number())))
   end subroutine draw_spectrum

   !> &poincare, where there is a harmonic load, mostly with sections in the run.
   subroutine draw_poincare(names, draft)
      !> The table of names
      type(name_t), intent(in) :: names(:)
      !> The scene
      type(draft_t), intent(inout) :: draft

      real(wp) :: period, periods

      period = period_in(draft)
      if (period <= 0.0_wp) return
      if (chance(0.2_wp)) then
         call draw_group(names, 'frequency_response', 0.5_wp, draft)
         call drop(draft, 'frequency_response', 'frequency_range')
         call put(draft, 'frequency_response', 'frequency_ratio_range', ascending(2, between(0.1_wp, 1000.0_wp, .true.)))
         call put(draft, 'frequency_response', 'points', to_text(2 + int(50.0_wp*number())))
      end if
      if (chance(0.5_wp)) return
      call put(draft, 'poincare', '', '')
      call draw_group(names, 'poincare', 0.4_wp, draft)
      if (has_name(draft, 'sweep', '') .and. chance(0.5_wp)) then
         call draw_chain(draft)
         return
      end if
      if (chance(0.8_wp)) call put(draft, 'poincare', 'load', '1')
      if (period < 10.0_wp .and. chance(0.3_wp)) then
         ! the run ends with the last of a few
         call drop(draft, 'response', 'duration')
         call drop(draft, 'response', 'duration_time')
         call put(draft, 'response', 'step', to_text(0.05_wp*period))
         call put(draft, 'poincare', 'skip', to_text(int(5.0_wp*number())))
         call put(draft, 'poincare', 'keep', to_text(1 + int(5.0_wp*number())))
      else
         periods = number_of(draft, 'response', 'duration')/period
         if (periods < 2.0_wp) then
            call drop(draft, 'poincare', '')
         else if (chance(0.9_wp)) then
            call put(draft, 'poincare', 'skip', to_text(int(min(1.0e6_wp, (periods - 1.0_wp)*number()))))
         end if
      end if
   end subroutine draw_poincare

   !> A beam under a harmonic load or without damping does not come to rest, nor does a body on a spring without a damper,
   !> and each period needs some hundred evaluations. The duration of a run is therefore limited to a number of periods of
   !> the fastest load or body, or of omega1. A search for the mesh takes the ratio of neighbouring elements as that of eight
   !> elements; without damping in proportion to the stiffness, its shortest elements would vibrate for hours.
   subroutine bound_periods(draft)
      type(draft_t), intent(inout) :: draft

      real(wp), parameter :: max_periods = 1.0e3_wp
      character(*), parameter :: loads(4) = [character(7) :: 'force_1', 'force_2', 'base_1', 'base_2']
      character(*), parameter :: dampings(3) = [character(11) :: 'zeta', 'zeta_mass', 'mode_ratios']
      real(wp) :: fastest, frequency, longest, share
      integer :: k
      logical :: is_damped

      is_damped = has_name(draft, 'damping', 'zeta')
      if (is_damped) is_damped = number_of(draft, 'damping', 'zeta') > 0.0_wp
      if (has_name(draft, 'mesh', 'tolerance') .and. .not. is_damped) call drop(draft, 'mesh', 'ratio')
      fastest = 1.0_wp
      do k = 1, size(dampings)
         if (.not. has_name(draft, 'damping', trim(dampings(k)))) cycle
         if (number_of(draft, 'damping', trim(dampings(k))) > 0.0_wp) fastest = 0.0_wp
      end do
      do k = 1, size(loads)
         associate (group => loads(k))
            if (.not. has_name(draft, group, 'amplitude_ratio')) cycle
            if (all(value_of(draft, group, 'kind') /= [character(10) :: '', '''harmonic'''])) cycle
            if (.not. has_name(draft, group, 'frequency_ratio')) fastest = max(fastest, 1.0_wp)
            if (has_name(draft, group, 'frequency_ratio')) fastest = max(fastest, number_of(draft, group, 'frequency_ratio'))
         end associate
      end do
      do k = 1, 3
         associate (group => 'body_'//to_text(k))
            if (.not. (has_name(draft, group, 'spring_ratio') .and. has_name(draft, group, 'mass_ratio'))) cycle
            if (has_name(draft, group, 'damping_ratio')) then
               if (number_of(draft, group, 'damping_ratio') > 1.0e-3_wp) cycle
            end if
            frequency = sqrt(3.0_wp*number_of(draft, group, 'spring_ratio') &
               /(lambda1_power4*number_of(draft, group, 'mass_ratio')))
            ! periods of the load, and not a duration, are the length of periodic motions
            if (has_name(draft, 'orbit', 'skip') .and. frequency > max_periods) then
               call drop(draft, group, 'spring_ratio')
               cycle
            end if
            fastest = max(fastest, frequency)
         end associate
      end do
      if (.not. has_name(draft, 'response', 'duration') .or. fastest <= 0.0_wp) return
      longest = max(1.0e-9_wp, max_periods*2.0_wp*acos(-1.0_wp)/fastest)
      share = longest/number_of(draft, 'response', 'duration')
      ! what is usual stays as it is, but for millions of periods
      if (share >= merge(0.01_wp, 1.0_wp, number_of(draft, 'response', 'duration') <= 60.0_wp)) return
      call put(draft, 'response', 'duration', to_text(longest))
      if (.not. has_name(draft, 'response', 'step')) return
      call put(draft, 'response', 'step', to_text(min(longest, max(1.0e-9_wp, share*number_of(draft, 'response', &
         'step')))))
   end subroutine bound_periods

   !> Of the first harmonic load of a scene; 0: it has none.
   function period_in(draft) result(period)
      type(draft_t), intent(in) :: draft
      real(wp) :: period

      character(*), parameter :: loads(4) = [character(7) :: 'force_1', 'force_2', 'base_1', 'base_2']
      integer :: k

      period = 0.0_wp
      do k = size(loads), 1, -1
         associate (group => loads(k))
            if (.not. has_name(draft, group, 'amplitude_ratio')) cycle
            if (all(value_of(draft, group, 'kind') /= [character(10) :: '', '''harmonic'''])) cycle
            period = 2.0_wp*acos(-1.0_wp)
            if (has_name(draft, group, 'frequency_ratio')) period = period/number_of(draft, group, 'frequency_ratio')
         end associate
      end do
   end function period_in

   !> &orbit, where there is a harmonic load, with branches of a few points.
   subroutine draw_orbit(names, draft)
      !> The table of names
      type(name_t), intent(in) :: names(:)
      !> The scene
      type(draft_t), intent(inout) :: draft

      character(*), parameter :: loads(4) = [character(7) :: 'force_1', 'force_2', 'base_1', 'base_2']
      integer :: k

      if (period_in(draft) <= 0.0_wp .or. period_in(draft) > 20.0_wp) return
      call drop(draft, 'sweep', '')
      call drop(draft, 'best', '')
      call drop(draft, 'cases', '')
      do k = 1, size(loads)
         call drop(draft, loads(k), 'start')
         call drop(draft, loads(k), 'end')
      end do
      call put(draft, 'orbit', '', '')
      call draw_group(names, 'orbit', 0.4_wp, draft)
      call put(draft, 'orbit', 'skip', to_text(1 + int(5.0_wp*number())))
      if (chance(0.7_wp)) call put(draft, 'orbit', 'periods', to_text(1 + int(2.0_wp*number())))
      if (chance(0.5_wp)) call put(draft, 'orbit', 'load', '1')
      call put(draft, 'orbit', 'most_points', to_text(1 + int(4.0_wp*number())))
      call put(draft, 'orbit', 'most_steps', to_text(1 + int(12.0_wp*number())))
      if (has_name(draft, 'orbit', 'doublings')) call put(draft, 'orbit', 'doublings', to_text(int(2.0_wp*number())))
   end subroutine draw_orbit

   !> A mesh of given nodes.
   subroutine draw_nodes(draft)
      !> The scene
      type(draft_t), intent(inout) :: draft

      character(*), parameter :: others(3) = [character(9) :: 'elements', 'ratio', 'tolerance']
      real(wp) :: length, step(8)
      integer :: count, i

      do i = 1, size(others)
         call drop(draft, 'mesh', trim(others(i)))
      end do
      length = 1.0_wp
      if (has_name(draft, 'beam', 'length')) length = number_of(draft, 'beam', 'length')
      count = 1 + int(8.0_wp*number())
      step(:count) = [(0.05_wp + number(), i=1, count)]
      call put(draft, 'mesh', 'nodes', list([(length*sum(step(:i))/sum(step(:count)), i=0, count - 1), length]))
   end subroutine draw_nodes

   !> What holds the root, and masses.
   subroutine draw_body(names, draft)
      !> The table of names
      type(name_t), intent(in) :: names(:)
      !> The scene
      type(draft_t), intent(inout) :: draft

      character(:), allocatable :: group
      integer :: k

      if (chance(0.6_wp)) then
         call draw_group(names, 'root', 0.6_wp, draft)
         if (value_of(draft, 'root', 'kind') == '''pinned''' .and. chance(0.8_wp)) then
            call put(draft, 'support_1', 'position', to_text(between(0.1_wp, 0.9_wp, .false.)))
         end if
      end if
      do k = 1, int(4.0_wp*number())
         group = 'mass_'//to_text(k)
         call put(draft, group, 'mass_ratio', to_text(between(0.01_wp, 5.0_wp, .true.)))
         call draw_group(names, 'mass_1', 0.6_wp, draft, group)
         if (k > 1) call drop(draft, group, 'mass')
         if (k > 1) call drop(draft, group, 'rotary_inertia')
      end do
   end subroutine draw_body

   !> Drop the names of &beam that say length and section.
   subroutine empty_beam(draft)
      type(draft_t), intent(inout) :: draft

      character(*), parameter :: of_beam(10) = [character(17) :: 'length', 'width', 'height_root', 'height_tip', 'taper', &
         'mean_height_ratio', 'station', 'height', 'area', 'inertia']
      integer :: i

      do i = 1, size(of_beam)
         if (has_name(draft, 'beam', trim(of_beam(i)))) call drop(draft, 'beam', trim(of_beam(i)))
      end do
   end subroutine empty_beam

   !> A section of any shape, instead of that of &beam.
   subroutine draw_section(draft)
      !> The scene
      type(draft_t), intent(inout) :: draft

      character(*), parameter :: shapes(4) = [character(9) :: 'rectangle', 'round', 'tube', 'general']
      integer :: profile, shape

      call empty_beam(draft)
      shape = 1 + int(4.0_wp*number())
      profile = int(4.0_wp*number())
      call put(draft, 'section', 'shape', ''''//trim(shapes(shape))//'''')
      if (profile == 1) call put(draft, 'section', 'profile', '''linear''')
      if (profile == 2) call put(draft, 'section', 'profile', '''stepped''')
      if (profile == 3) call put(draft, 'section', 'profile', '''cubic''')
      if (profile > 0) call put(draft, 'section', 'station', trim(merge('0, 0.4   ', '0, 0.4, 1', profile == 2)))
      select case (shape)
      case (1)
         call put(draft, 'section', 'height', sizes(0.05_wp))
         if (chance(0.5_wp)) call put(draft, 'section', 'width', sizes(0.05_wp))
      case (2)
         call put(draft, 'section', 'diameter', sizes(0.05_wp))
      case (3)
         call put(draft, 'section', 'outer_diameter', sizes(0.05_wp))
         if (chance(0.5_wp)) then
            call put(draft, 'section', 'wall', sizes(0.005_wp))
         else
            call put(draft, 'section', 'inner_diameter', sizes(0.02_wp))
         end if
      case default
         call put(draft, 'section', 'area', sizes(1.0_wp))
         call put(draft, 'section', 'inertia', sizes(1.0e-4_wp))
         if (chance(0.5_wp)) call put(draft, 'section', 'outer_fibre', sizes(0.02_wp))
      end select

   contains

      !> One value, or one for each station, within a factor of two.
      function sizes(least) result(text)
         real(wp), intent(in) :: least
         character(:), allocatable :: text

         integer :: k

         text = to_text(least*(1.0_wp + number()))
         if (profile == 0 .or. chance(0.3_wp)) return
         do k = 2, merge(2, 3, profile == 2)
            text = text//', '//to_text(least*(1.0_wp + number()))
         end do
      end function sizes

   end subroutine draw_section

   !> Further stops, most of which the beam can start between, and supports.
   subroutine draw_others(names, draft)
      !> The table of names
      type(name_t), intent(in) :: names(:)
      !> The scene
      type(draft_t), intent(inout) :: draft

      character(:), allocatable :: group
      integer :: k

      do k = 2, 1 + int(4.0_wp*number())
         group = 'stop_'//to_text(k)
         call put(draft, group, '', '')
         call draw_group(names, 'stop', 0.4_wp, draft, group)
         if (chance(0.2_wp)) cycle
         call drop(draft, group, 'clearance_ratio')
         call drop(draft, group, 'pulled')
         select case (value_of(draft, group, 'side'))
         case ('''both''')
            call put(draft, group, 'clearance_ratio', to_text(between(1.0_wp, 4.0_wp, .false.)))
         case ('''above''')
            call put(draft, group, 'preload', to_text(-between(1.2_wp, 4.0_wp, .false.)))
         case default
            call put(draft, group, 'preload', to_text(-between(0.0_wp, 2.0_wp, .false.)))
         end select
      end do
      do k = 1, int(3.0_wp*number())
         group = 'support_'//to_text(k)
         call put(draft, group, '', '')
         call draw_group(names, 'support_1', 0.7_wp, draft, group)
         if (k > 1) call drop(draft, group, 'stiffness')
      end do
   end subroutine draw_others

   !> Forces, what moves the base, and another start.
   subroutine draw_loads(names, draft)
      !> The table of names
      type(name_t), intent(in) :: names(:)
      !> The scene
      type(draft_t), intent(inout) :: draft

      character(:), allocatable :: group
      integer :: i, k

      do k = 1, int(3.0_wp*number())
         group = 'force_'//to_text(k)
         call put(draft, group, '', '')
         call draw_group(names, 'force_1', 0.4_wp, draft, group)
         if (chance(0.6_wp)) then
            call put(draft, group, 'position', list([(number(), i=1, 1 + int(2.0_wp*number()))]))
            call drop(draft, group, 'stretch')
         else
            call put(draft, group, 'stretch', ascending(2, 1.0_wp))
            call drop(draft, group, 'position')
         end if
         call draw_course(draft, group)
      end do
      do k = 1, int(3.0_wp*number())
         group = 'base_'//to_text(k)
         call put(draft, group, '', '')
         call draw_group(names, 'base_1', 0.4_wp, draft, group)
         call draw_course(draft, group)
         if (chance(0.3_wp)) then
            call drop(draft, group, '')
            call put(draft, group, 'gravity_ratio', to_text(between(0.01_wp, 10.0_wp, .true.)))
         end if
      end do
      if (chance(0.3_wp)) return
      if (chance(0.3_wp)) call drop_stops(draft)
      call draw_start(names, draft)
   end subroutine draw_loads

   !> Nothing in the beam's way.
   subroutine drop_stops(draft)
      type(draft_t), intent(inout) :: draft

      integer :: k

      call drop(draft, 'stop', '')
      do k = 2, 5
         call drop(draft, 'stop_'//to_text(k), '')
      end do
   end subroutine drop_stops

   !> An amplitude, and a table if it needs one.
   subroutine draw_course(draft, group)
      type(draft_t), intent(inout) :: draft
      character(*), intent(in) :: group

      integer :: i, points

      if (.not. has_name(draft, group, 'amplitude_ratio')) call put(draft, group, 'amplitude_ratio', &
         to_text(between(-2.0_wp, 2.0_wp, .false.)))
      if (value_of(draft, group, 'kind') == '''pulse''') call put(draft, group, 'duration', &
         to_text(between(0.01_wp, 10.0_wp, .true.)))
      call drop(draft, group, 'table')
      call drop(draft, group, 'times')
      call drop(draft, group, 'values')
      if (value_of(draft, group, 'kind') /= '''table''') return
      points = 2 + int(9.0_wp*number())
      if (chance(0.2_wp)) then
         call put(draft, group, 'table', ''''//table_file//'''')
      else
         call put(draft, group, 'times', ascending(points, between(0.1_wp, 30.0_wp, .true.)))
         call put(draft, group, 'values', list([(2.0_wp*number() - 1.0_wp, i=1, points)]))
      end if
   end subroutine draw_course

   !> How the motion begins, with what that needs most of the time.
   subroutine draw_start(names, draft)
      !> The table of names
      type(name_t), intent(in) :: names(:)
      !> The scene
      type(draft_t), intent(inout) :: draft

      integer :: i, points

      call put(draft, 'start', '', '')
      call draw_group(names, 'start', 0.3_wp, draft)
      call put(draft, 'start', 'kind', ''''//trim(start_names(1 + int(real(size(start_names), wp)*number())))//'''')
      call drop(draft, 'start', 'position')
      call drop(draft, 'start', 'displacement_ratios')
      call drop(draft, 'start', 'velocity_ratios')
      select case (value_of(draft, 'start', 'kind'))
      case ('''velocity''', '''mode''')
         call put(draft, 'start', 'velocity_ratio', to_text(between(-2.0_wp, 2.0_wp, .false.)))
      case ('''drop''')
         if (chance(0.3_wp)) then
            call drop(draft, 'start', 'height_ratio')
            call put(draft, 'start', 'velocity_ratio', to_text(between(0.1_wp, 2.0_wp, .true.)))
         else
            call drop(draft, 'start', 'velocity_ratio')
            call put(draft, 'start', 'height_ratio', to_text(between(0.1_wp, 2.0_wp, .true.)))
            call put(draft, 'base_1', 'gravity_ratio', to_text(between(0.1_wp, 2.0_wp, .true.)))
         end if
      case ('''table''')
         points = 2 + int(4.0_wp*number())
         call put(draft, 'start', 'position', ascending(points, 1.0_wp))
         call put(draft, 'start', 'displacement_ratios', list([(number(), i=1, points)]))
         if (chance(0.7_wp)) call put(draft, 'start', 'velocity_ratios', list([(number(), i=1, points)]))
         if (chance(0.6_wp)) call draw_smooth_table(draft)
      end select
      if (chance(0.15_wp)) call draw_touching_start(draft)
   end subroutine draw_start

   !> A start table of a smooth shape at mostly more points than the mesh has nodes, zero at the clamp and at supports.
   subroutine draw_smooth_table(draft)
      !> The scene
      type(draft_t), intent(inout) :: draft

      integer, parameter :: max_points = 18
      real(wp), dimension(max_points) :: x, y
      real(wp) :: bend, place
      integer :: k, points

      points = 3 + int(real(max_points - 2, wp)*number())
      x(:points) = [(real(k - 1, wp), k=1, points)]/real(points - 1, wp)
      if (chance(0.5_wp)) x(2:points - 1) = x(2:points - 1) + 0.3_wp*(number() - 0.5_wp)/real(points, wp)
      bend = number()
      y(:points) = x(:points)**2*(3.0_wp - 2.0_wp*bend*x(:points))
      do k = 1, 2
         if (.not. has_name(draft, 'support_'//to_text(k), '')) cycle
         place = 1.0_wp
         if (has_name(draft, 'support_'//to_text(k), 'position')) place = number_of(draft, 'support_'//to_text(k), 'position')
         y(:points) = y(:points)*(x(:points) - place)
      end do
      call put(draft, 'start', 'position', rounded(x(:points)))
      call put(draft, 'start', 'displacement_ratios', rounded(0.5_wp*number()*y(:points)))
      if (chance(0.7_wp)) call put(draft, 'start', 'velocity_ratios', rounded((2.0_wp*number() - 1.0_wp)*y(:points)))

   contains

      !> A list of so few digits that a draft has room for it.
      function rounded(values) result(text)
         real(wp), intent(in) :: values(:)
         character(:), allocatable :: text

         real(wp), parameter :: digits = 1.0e12_wp

         text = list(anint(values*digits)/digits)
      end function rounded

   end subroutine draw_smooth_table

   !> At rest on stops that the beam just touches, or a rounding error beyond them, until loads come, if there are any.
   subroutine draw_touching_start(draft)
      !> The scene
      type(draft_t), intent(inout) :: draft

      character(:), allocatable :: group
      integer :: k

      call drop(draft, 'start', '')
      call put(draft, 'start', 'kind', trim(merge('''rest''   ', '''balance''', chance(0.8_wp))))
      do k = 1, 5
         group = 'stop'
         if (k > 1) group = 'stop_'//to_text(k)
         if (.not. has_name(draft, group, '') .or. (k > 1 .and. chance(0.3_wp))) cycle
         if (value_of(draft, group, 'side') == '''both''') call drop(draft, group, 'side')
         call drop(draft, group, 'clearance_ratio')
         call put(draft, group, 'preload', merge('0    ', '5e-10', chance(0.8_wp)))
      end do
      do k = 1, 2
         group = 'force_'//to_text(k)
         if (has_name(draft, group, '') .and. chance(0.7_wp)) call put(draft, group, 'start', to_text(number()))
         group = 'base_'//to_text(k)
         if (has_name(draft, group, 'amplitude_ratio') .and. chance(0.7_wp)) call put(draft, group, 'start', &
            to_text(number()))
      end do
   end subroutine draw_touching_start

   !> So many numbers from 0 to the most, ascending.
   function ascending(count, most) result(text)
      integer, intent(in) :: count
      real(wp), intent(in) :: most
      character(:), allocatable :: text

      real(wp) :: steps(count)
      integer :: i

      steps = [(0.01_wp + number(), i=1, count)]
      text = list(most*[(sum(steps(:i)), i=1, count)]/sum(steps))
   end function ascending

   !> A number between 0 and 1.
   function number() result(value)
      real(wp) :: value

      call next_random(random, value)
   end function number

   !> True in this share of all cases.
   function chance(share) result(is_so)
      real(wp), intent(in) :: share
      logical :: is_so

      is_so = number() < share
   end function chance

   !> Each name of a group in this share of all cases.
   subroutine draw_group(names, group, share, draft, label)
      !> The table of names
      type(name_t), intent(in) :: names(:)
      !> The group
      character(*), intent(in) :: group
      !> The share
      real(wp), intent(in) :: share
      !> The scene
      type(draft_t), intent(inout) :: draft
      !> What the draft calls it, where that is something else
      character(*), intent(in), optional :: label

      character(:), allocatable :: place
      integer :: i

      place = group
      if (present(label)) place = label
      do i = 1, size(names)
         ! what results are in is tested in tests/study; those here are read without units
         if (names(i)%group /= group .or. names(i)%name == 'units') cycle
         if (chance(merge(0.01_wp, share, names(i)%is_physical))) call put(draft, place, trim(names(i)%name), &
            value_for(names(i)))
      end do
   end subroutine draw_group

   !> A value that the table allows.
   function value_for(name) result(value)
      !> The name
      type(name_t), intent(in) :: name
      character(:), allocatable :: value

      integer :: i, count

      value = ''
      select case (name%kind)
      case (kind_text)
         value = '''any text'''
      case (kind_logical)
         value = trim(merge('.true. ', '.false.', chance(0.5_wp)))
      case (kind_words)
         do i = 1, name%word_count
            if (chance(0.5_wp) .and. name%is_list) value = value//', '''//trim(name%words(i))//''''
         end do
         if (value /= '') value = value(3:)
         if (value == '') value = ''''//trim(name%words(1 + int(number()*real(name%word_count, wp))))//''''
      case (kind_number)
         count = 1
         if (name%is_list) count = 1 + int(3.0_wp*number())
         value = numbers_for(name, name%group, trim(name%name), count)
      end select
   end function value_for

   !> A list of numbers.
   function numbers_for(name, group, usual_name, count) result(text)
      !> What is allowed
      type(name_t), intent(in) :: name
      !> Where else the same number stands
      character(*), intent(in) :: group
      character(*), intent(in) :: usual_name
      !> How many
      integer, intent(in) :: count
      character(:), allocatable :: text

      real(wp) :: value
      integer :: i

      text = ''
      do i = 1, count
         value = draw_number(name, group, usual_name)
         if (i > 1) text = text//', '
         if (name%is_whole) then
            text = text//to_text(nint(value))
         else
            text = text//to_text(value)
         end if
      end do
   end function numbers_for

   !> A number within its range.
   function draw_number(name, group, usual_name) result(value)
      !> What is allowed
      type(name_t), intent(in) :: name
      !> Where it stands in the list of usual ones
      character(*), intent(in) :: group
      character(*), intent(in) :: usual_name
      real(wp) :: value

      real(wp), parameter :: special(*) = [0.0_wp, 1.0_wp, -1.0_wp, 0.5_wp, 0.25_wp, 1.0_wp/6.0_wp, 2.0_wp]
      real(wp) :: choice, least, most
      integer :: k

      least = name%least
      most = name%most
      k = findloc(usual%group == group .and. usual%name == usual_name, .true., dim=1)
      if (k > 0) most = min(most, usual(k)%affordable)
      choice = number()
      if (k > 0 .and. choice < 0.55_wp) then
         value = between(usual(k)%least, usual(k)%most, usual(k)%is_logarithmic)
      else if (choice < 0.65_wp) then
         value = merge(least, most, chance(0.5_wp))
      else if (choice < 0.70_wp) then
         value = between(least, most, .false.)
      else if (choice < 0.90_wp) then
         value = special(1 + int(number()*real(size(special), wp)))
         if (name%has_default .and. chance(0.3_wp)) value = name%default
         if (chance(0.5_wp)) value = value + sign(10.0_wp**(-16.0_wp*number()), number() - 0.5_wp)
      else if (least > 0.0_wp) then
         value = between(least, most, .true.)
      else
         value = most*10.0_wp**(-20.0_wp*number())
         if (least < 0.0_wp .and. chance(0.5_wp)) value = -value
      end if
      value = max(least, min(most, value))
      if (name%is_whole) value = anint(value)
      if (name%excludes_least .and. value <= least) value = least + (most - least)*10.0_wp**(-15.0_wp*number())
   end function draw_number

   !> Uniform, or uniform in the logarithm.
   function between(least, most, is_logarithmic) result(value)
      real(wp), intent(in) :: least
      real(wp), intent(in) :: most
      logical, intent(in) :: is_logarithmic
      real(wp) :: value

      value = least + (most - least)*number()
      if (is_logarithmic) value = least*(most/least)**number()
   end function between

   !> A beam: heights, taper, tables, in any units.
   subroutine draw_beam(names, draft)
      !> The table of names
      type(name_t), intent(in) :: names(:)
      !> The scene
      type(draft_t), intent(inout) :: draft

      real(wp) :: length, height, shape(5), places(5)
      integer :: count, i

      if (chance(0.4_wp)) return
      if (chance(0.05_wp)) then
         call draw_group(names, 'beam', 0.4_wp, draft)
         return
      end if
      length = 1.0_wp
      if (chance(0.3_wp)) then
         length = between(1.0e-9_wp, 1.0e6_wp, .true.)
         call put(draft, 'beam', 'length', to_text(length))
         call put(draft, 'beam', 'width', to_text(between(1.0e-9_wp, 1.0e6_wp, .true.)))
         call put(draft, 'beam', 'youngs_modulus', to_text(between(1.0e-15_wp, 1.0e15_wp, .true.)))
         call put(draft, 'beam', 'density', to_text(between(1.0e-15_wp, 1.0e15_wp, .true.)))
      end if
      height = merge(0.075_wp, between(1.0e-6_wp, 0.5_wp, .true.), chance(0.6_wp))
      count = 2 + int(4.0_wp*number())
      shape = [(10.0_wp**(2.0_wp*number() - 1.0_wp), i=1, 5)]
      if (chance(0.2_wp)) shape(count) = 0.0_wp
      if (chance(0.1_wp)) shape(:count - 1) = 1.0_wp
      places(:count) = [(real(i - 1, wp), i=1, count)]/real(count - 1, wp)
      if (count > 2) places(2) = places(3)*number()
      select case (int(5.0_wp*number()))
      case (0)
         call put(draft, 'beam', 'mean_height_ratio', to_text(height))
         call put(draft, 'beam', 'taper', to_text(2.0_wp*height*merge(1.0_wp, 2.0_wp*number() - 1.0_wp, &
            chance(0.2_wp))))
      case (1)
         call put(draft, 'beam', 'height_root', to_text(length*height))
         if (chance(0.7_wp)) call put(draft, 'beam', 'height_tip', to_text(length*height*shape(count)))
      case (2)
         call put(draft, 'beam', 'station', list(length*places(:count)))
         call put(draft, 'beam', 'height', list(length*height*shape(:count)))
      case (3)
         call drop(draft, 'beam', 'width')
         call put(draft, 'beam', 'station', list(length*places(:count)))
         call put(draft, 'beam', 'area', list(length**2*height*shape(:count)))
         call put(draft, 'beam', 'inertia', list(length**4*height**3*shape(:count)**merge(3, 1, chance(0.5_wp))))
      case (4)
         call drop(draft, 'beam', 'width')
         call put(draft, 'beam', 'area', to_text(length**2*height))
         call put(draft, 'beam', 'inertia', to_text(length**4*height**3))
      end select
   end subroutine draw_beam

   !> Numbers side by side.
   function list(values) result(text)
      real(wp), intent(in) :: values(:)
      character(:), allocatable :: text

      integer :: i

      text = to_text(values(1))
      do i = 2, size(values)
         text = text//', '//to_text(values(i))
      end do
   end function list

   !> &response: a duration, and a step that divides it into not too many.
   subroutine draw_response(names, draft)
      !> The table of names
      type(name_t), intent(in) :: names(:)
      !> The scene
      type(draft_t), intent(inout) :: draft

      real(wp) :: duration
      integer :: i

      call put(draft, 'response', '', '')
      call draw_group(names, 'response', 0.4_wp, draft)
      ! an undamped beam never tires
      if (.not. has_name(draft, 'response', 'event_limit')) call put(draft, 'response', 'event_limit', '3000')
      do i = 1, size(names)
         if (names(i)%group == 'response' .and. names(i)%name == 'duration') &
            call put(draft, 'response', 'duration', value_for(names(i)))
      end do
      ! substeps of a scheme that is stable for short ones alone shorten with the square of the element
      if (value_of(draft, 'response', 'substep') == '.true.') then
         call drop(draft, 'mesh', 'tolerance')
         call drop(draft, 'mesh', 'estimate')
         call drop(draft, 'mesh', 'ratio')
         call drop(draft, 'root', 'translation_stiffness_ratio')
         ! with the stiffness of a spring, too; a support without one is rigid
         do i = 1, 4
            call drop(draft, 'support_'//to_text(i), 'stiffness_ratio')
         end do
         if (has_name(draft, 'mesh', 'elements')) call put(draft, 'mesh', 'elements', &
            to_text(nint(min(8.0_wp, number_of(draft, 'mesh', 'elements')))))
      end if
      ! no step is shorter than 1e-9, no run shorter than a step
      duration = max(1.0e-9_wp, number_of(draft, 'response', 'duration'))
      call put(draft, 'response', 'duration', to_text(duration))
      if (chance(0.1_wp) .and. .not. has_name(draft, 'response', 'newmark_beta')) then
         ! one that dies away lets `exact` go on for long
         duration = between(100.0_wp, 1.0e9_wp, .true.)
         call put(draft, 'response', 'method', '''exact''')
         call put(draft, 'response', 'duration', to_text(duration))
         call put(draft, 'damping', 'zeta', to_text(between(1.0e-3_wp, 1.0_wp, .true.)))
      end if
      call put(draft, 'response', 'step', to_text(min(1.0e9_wp, max(1.0e-9_wp, duration/between(1.0_wp, 4000.0_wp, &
         .true.)))))
   end subroutine draw_response

   !> &statistics of a part of the run, mostly.
   subroutine draw_statistics(names, draft)
      type(name_t), intent(in) :: names(:)
      type(draft_t), intent(inout) :: draft

      real(wp) :: duration

      call put(draft, 'statistics', '', '')
      call draw_group(names, 'statistics', 0.4_wp, draft)
      ! an impulse on a node alone is none of theirs
      call drop(draft, 'stop', 'impulse')
      duration = number_of(draft, 'response', 'duration')
      if (has_name(draft, 'statistics', 'start')) call put(draft, 'statistics', 'start', to_text(0.5_wp*duration*number()))
      if (has_name(draft, 'statistics', 'end')) call put(draft, 'statistics', 'end', &
         to_text(duration*(0.6_wp + 0.4_wp*number())))
      if (has_name(draft, 'statistics', 'rest') .and. chance(0.7_wp)) call put(draft, 'statistics', 'rest', &
         to_text(0.1_wp*duration*number()**4))
   end subroutine draw_statistics

   !> A sweep whose cases go on one from the other, under loads of one frequency.
   subroutine draw_chain(draft)
      type(draft_t), intent(inout) :: draft

      character(*), parameter :: loads(4) = [character(7) :: 'force_1', 'force_2', 'base_1', 'base_2']
      character(*), parameter :: without(8) = [character(15) :: 'frequency_ratio', 'start', 'end', 'start_time', 'end_time', &
         'duration', 'duration_time', 'shape']
      integer :: i, k

      do k = 1, size(loads)
         if (.not. has_name(draft, trim(loads(k)), 'amplitude_ratio')) cycle
         call put(draft, trim(loads(k)), 'kind', '''harmonic''')
         do i = 1, size(without)
            call drop(draft, trim(loads(k)), trim(without(i)))
         end do
         call draw_course(draft, trim(loads(k)))
      end do
      call drop(draft, 'sweep', '')
      call drop(draft, 'best', '')
      call drop(draft, 'mesh', 'estimate')
      call drop(draft, 'damping', 'mode_ratios')
      call drop(draft, 'response', 'duration')
      call drop(draft, 'response', 'duration_time')
      call put(draft, 'response', 'step', '0.1')
      call put(draft, 'poincare', 'load', '0')
      call put(draft, 'poincare', 'skip', to_text(int(3.0_wp*number())))
      call put(draft, 'poincare', 'keep', to_text(1 + int(3.0_wp*number())))
      call put(draft, 'sweep', 'zeta', list([(0.01_wp + 0.1_wp*number(), i=1, 2)]))
      call put(draft, 'sweep', 'carry', '''zeta''')
      if (chance(0.5_wp)) call put(draft, 'sweep', 'carry_back', '.true.')
   end subroutine draw_chain

   !> Instants of shapes within the run.
   subroutine draw_instants(draft)
      !> The scene
      type(draft_t), intent(inout) :: draft

      real(wp) :: duration
      integer :: i

      duration = number_of(draft, 'response', 'duration')
      if (has_name(draft, 'output', 'shape_times')) &
         call put(draft, 'output', 'shape_times', list([(duration*(real(i, wp) - number())/4.0_wp, i=1, 4)]))
      if (has_name(draft, 'output', 'shape_step')) &
         call put(draft, 'output', 'shape_step', to_text(duration*between(1.0e-3_wp, 2.0_wp, .true.)))
   end subroutine draw_instants

   !> Few modes of meshes as large as they may be.
   subroutine draw_large_meshes(draft)
      !> The scene
      type(draft_t), intent(inout) :: draft

      integer :: elements

      elements = nint(between(100.0_wp, 2.0e5_wp, .true.))
      call put(draft, 'frequencies', 'count', to_text(1 + int(4.0_wp*number())))
      call put(draft, 'frequencies', 'solver', trim(merge('''lanczos''', '''auto''   ', chance(0.5_wp))))
      call drop(draft, 'frequencies', 'mesh_elements')
      call drop(draft, 'frequencies', 'mesh_ratios')
      call put(draft, 'mesh', 'elements', to_text(elements))
      call put(draft, 'mesh', 'ratio', '1')
      ! with these the solver is a dense one
      call drop(draft, 'root', 'kind')
      call drop(draft, 'support_1', '')
      call drop(draft, 'support_2', '')
   end subroutine draw_large_meshes

   !> A sweep of a few cases.
   subroutine draw_sweep(names, draft, swept)
      !> The table of names
      type(name_t), intent(in) :: names(:)
      !> The scene
      type(draft_t), intent(inout) :: draft
      !> Place of a name that it shall have; missing: any
      integer, intent(in), optional :: swept

      character(:), allocatable :: group, name, parameter, tied
      integer :: i, count, first, length, wanted, design

      call put(draft, 'sweep', '', '')
      design = int(3.0_wp*number())
      first = 0
      if (present(swept)) then
         first = swept
         ! only lists are paired
         if (design == 1 .and. index(names(swept)%name, '_range') > 0) design = 2
         count = index(names(swept)%name, '_points')
         if (count > 0) then
            ! they go with a range
            design = 0
            first = findloc(names%name == names(swept)%name(:count - 1)//'_range', .true., dim=1)
         end if
      end if
      if (design == 1) call put(draft, 'sweep', 'design', '''paired''')
      if (design == 2) call put(draft, 'sweep', 'design', '''latin_hypercube''')
      call draw_group(names(pack([(i, i=1, size(names))], names%name == 'part_cases' .or. names%name == 'count' &
         .or. names%name == 'seed' .or. names%name == 'design')), 'sweep', 0.2_wp, draft)
      if (design == 2) call put(draft, 'sweep', 'count', to_text(1 + int(8.0_wp*number())))
      length = 1 + int(3.0_wp*number())
      wanted = 1 + int(2.0_wp*number())
      tied = ''
      count = 0
      do while (count < wanted)
         i = 1 + int(number()*real(size(names), wp))
         if (count == 0 .and. first > 0) i = first
         if (names(i)%group /= 'sweep' .or. .not. names(i)%is_list .or. names(i)%name == 'tied') cycle
         ! names of bodies are a third of all, and few scenes have bodies
         if (i /= first .and. index(names(i)%name, 'body_') == 1) then
            if (.not. chance(share_of_bodies())) cycle
         end if
         parameter = names(i)%name(:base_length(names(i)%name))
         call place_of_parameter(names, parameter, group, name)
         if (any(group == [character(7) :: 'force_1', 'base_1', 'start'])) call make_count(group, name, draft)
         if (group == 'section') call make_section(name, draft)
         if (name == 'height_tip') then
            call empty_beam(draft)
            call put(draft, 'beam', 'height_root', '0.05')
         end if
         if (group == 'body_1') call put(draft, group, 'mass_ratio', '0.5')
         if (parameter /= names(i)%name) then
            call put(draft, 'sweep', trim(names(i)%name), ascending_pair(numbers_for(names(i), group, name, 2)))
            if (design == 0) call put(draft, 'sweep', parameter//'_points', &
               to_text(2 + int(2.0_wp*number())))
         else
            call put(draft, 'sweep', trim(names(i)%name), numbers_for(names(i), group, name, length))
            if (index(tied, "'"//parameter//"'") == 0) tied = tied//", '"//parameter//"'"
         end if
         if (parameter == 'mesh_ratio') call put(draft, 'mesh', 'elements', to_text(1 + int(4.0_wp*number())))
         if (parameter == 'elements' .or. parameter == 'mesh_ratio') call drop(draft, 'mesh', 'ratio')
         if (parameter == 'duration') call put(draft, 'response', 'step', '0.003')
         if (parameter == 'clearance_ratio') then
            call drop(draft, 'stop', 'preload')
            call put(draft, 'stop', 'side', '''both''')
            call put(draft, 'stop', 'clearance_ratio', '1')
         end if
         count = count + 1
      end do
      ! all lists have equally many values
      if (design == 0 .and. index(tied(2:), ',') > 0 .and. chance(0.9_wp)) call put(draft, 'sweep', 'tied', tied(3:))
      if (.not. chance(0.3_wp)) return
      call put(draft, 'best', '', '')
      call draw_group(names, 'best', 0.5_wp, draft)
      if (value_of(draft, 'best', 'refine') == '.true.' .and. .not. has_name(draft, 'best', 'evaluations')) &
         call put(draft, 'best', 'evaluations', '20')
   end subroutine draw_sweep

   !> The uniform section that has a dimension.
   subroutine make_section(name, draft)
      !> Name of the dimension in &section
      character(*), intent(in) :: name
      type(draft_t), intent(inout) :: draft

      call empty_beam(draft)
      if (has_name(draft, 'section', 'shape')) call drop(draft, 'section', '')
      select case (name)
      case ('width', 'height')
         call put(draft, 'section', 'shape', '''rectangle''')
         call put(draft, 'section', 'height', '0.05')
         call put(draft, 'section', 'width', '0.3')
      case ('diameter')
         call put(draft, 'section', 'shape', '''round''')
         call put(draft, 'section', 'diameter', '0.05')
      case default
         call put(draft, 'section', 'shape', '''tube''')
         call put(draft, 'section', 'outer_diameter', '0.05')
         if (name == 'inner_diameter') call put(draft, 'section', 'inner_diameter', '0.03')
         if (name /= 'inner_diameter') call put(draft, 'section', 'wall', '0.004')
      end select
   end subroutine make_section

   !> What a name of a load or of the start needs.
   subroutine make_count(group, name, draft)
      character(*), intent(in) :: group
      character(*), intent(in) :: name
      type(draft_t), intent(inout) :: draft

      if (group == 'force_1' .and. (name == 'position' .or. .not. has_name(draft, group, 'stretch'))) then
         call drop(draft, group, 'stretch')
         call put(draft, group, 'position', to_text(number()))
      end if
      if (group /= 'start' .and. .not. has_name(draft, group, 'amplitude_ratio')) then
         call put(draft, group, 'amplitude_ratio', to_text(number()))
      end if
      select case (name)
      case ('frequency_ratio', 'phase')
         call put(draft, group, 'kind', '''harmonic''')
      case ('duration')
         call put(draft, group, 'kind', '''pulse''')
         call put(draft, group, 'quantity', '''acceleration''')
      case ('start', 'end')
         call put(draft, group, 'kind', '''step''')
         call put(draft, group, 'quantity', '''acceleration''')
         if (group /= 'start') call drop(draft, group, 'start_time')
         if (group /= 'start') call drop(draft, group, 'end_time')
      case ('velocity_ratio')
         call put(draft, group, 'kind', '''velocity''')
         call put(draft, group, name, '1')
      case ('displacement_ratio', 'mode')
         call put(draft, group, 'kind', '''mode''')
         call put(draft, group, 'velocity_ratio', '1')
      case ('height_ratio')
         call put(draft, group, 'kind', '''drop''')
         call drop(draft, group, 'velocity_ratio')
         call put(draft, group, name, '1')
         call put(draft, 'base_1', 'gravity_ratio', '1')
      end select
      if (group == 'force_1') call drop(draft, group, 'quantity')
   end subroutine make_count

   !> Length of the name of a parameter, without `_range` or `_log_range`.
   pure function base_length(name) result(length)
      character(*), intent(in) :: name
      integer :: length

      length = index(name, '_log_range') - 1
      if (length < 0) length = index(name, '_range') - 1
      if (length < 0) length = len_trim(name)
   end function base_length

   !> Where a parameter of a sweep stands in a scene without one: under its name, or group and name are its name.
   pure subroutine place_of_parameter(names, parameter, group, name)
      !> The table of names
      type(name_t), intent(in) :: names(:)
      !> What &sweep or &cases calls it
      character(*), intent(in) :: parameter
      !> Where it stands
      character(:), allocatable, intent(out) :: group
      character(:), allocatable, intent(out) :: name

      integer :: i

      do i = 1, size(names)
         group = trim(names(i)%group)
         name = trim(names(i)%name)
         if (group//'_'//name == parameter) return
         if (group == 'body_1' .and. index(parameter, 'body_') == 1) then
            group = parameter(:6)
            if (group//'_'//name == parameter) return
         end if
         if (group == parameter .and. name == 'mass') return
         ! of several groups the label stands before the name
         if (name == parameter .and. index(group, '_1') == 0) return
      end do
   end subroutine place_of_parameter

   !> Two numbers, the smaller first.
   function ascending_pair(text) result(pair)
      character(*), intent(in) :: text
      character(:), allocatable :: pair

      real(wp) :: values(2)

      read (text, *) values
      pair = list([minval(values), maxval(values)])
   end function ascending_pair

   !> Several cases of one scene.
   subroutine draw_cases(names, draft)
      !> The table of names
      type(name_t), intent(in) :: names(:)
      !> The scene
      type(draft_t), intent(inout) :: draft

      character(:), allocatable :: group, name, parameter
      integer :: i

      do i = 1, size(names)
         if (names(i)%group == 'cases' .and. names(i)%name == 'parameter') exit
      end do
      parameter = value_for(names(i))
      call put(draft, 'cases', 'parameter', parameter)
      call place_of_parameter(names, parameter(2:len(parameter) - 1), group, name)
      ! all bodies have the names of the first
      if (index(group, 'body_') == 1) group = 'body_1'
      do i = 1, size(names)
         if (names(i)%group == group .and. names(i)%name == name) exit
      end do
      call put(draft, 'cases', 'values', numbers_for(names(i), group, name, 1 + int(3.0_wp*number())))
   end subroutine draw_cases

   !> A small beam that Newmark's steps can follow: damping, supports, roots, masses, loads and starts of all kinds, mostly
   !> with a stop that it does not touch at once.
   subroutine draw_steps(names, seed, draft)
      !> The table of names
      type(name_t), intent(in) :: names(:)
      !> Which scene
      integer, intent(in) :: seed
      !> The scene
      type(draft_t), intent(out) :: draft

      character(*), parameter :: schemes(4) = [character(22) :: '''average_acceleration''', '''linear_acceleration''', &
         '''explicit''', '''average_acceleration''']
      character(*), parameter :: matrices(4) = [character(15) :: '''consistent''', '''redistributed''', '''auto''', &
         '''consistent''']
      character(:), allocatable :: group
      integer :: i, k
      logical :: is_so

      call start_random(seed, 1, random)
      ! seeds that follow each other begin alike
      do i = 1, 16
         is_so = chance(0.5_wp)
      end do
      call put(draft, 'mesh', 'elements', to_text(1 + int(3.0_wp*number())))
      call put(draft, 'mesh', 'ratio', to_text(between(0.8_wp, 1.25_wp, .true.)))
      call put(draft, 'mesh', 'mass', trim(matrices(1 + int(4.0_wp*number()))))
      if (chance(0.3_wp)) call put(draft, 'beam', 'taper', to_text(between(-0.05_wp, 0.05_wp, .false.)))
      if (chance(0.4_wp)) then
         call put(draft, 'tip_mass', 'ratio', to_text(between(0.01_wp, 2.0_wp, .true.)))
      else if (value_of(draft, 'mesh', 'mass') == '''redistributed''') then
         call drop(draft, 'mesh', 'mass')
      end if
      call draw_damping(draft)
      call draw_held(draft)
      if (chance(0.8_wp)) then
         call put(draft, 'stop', '', '')
         call draw_group(names, 'stop', 0.3_wp, draft)
         call drop(draft, 'stop', 'impulse')
         call put(draft, 'stop', 'preload', to_text(-between(0.01_wp, 2.0_wp, .true.)))
         if (value_of(draft, 'stop', 'side') == '''both''') then
            call drop(draft, 'stop', 'preload')
            call put(draft, 'stop', 'clearance_ratio', to_text(between(0.01_wp, 2.0_wp, .true.)))
         end if
      end if
      if (has_name(draft, 'stop', '') .and. chance(0.2_wp)) then
         call put(draft, 'stop_2', 'position', to_text(between(0.3_wp, 1.0_wp, .false.)))
         call put(draft, 'stop_2', 'clearance_ratio', to_text(between(0.01_wp, 2.0_wp, .true.)))
         call put(draft, 'stop_2', 'side', '''both''')
      end if
      do k = 1, int(3.0_wp*number())
         group = 'force_'//to_text(k)
         if (chance(0.7_wp)) call put(draft, group, 'position', list([(number(), i=1, 1 + int(2.0_wp*number()))]))
         if (.not. has_name(draft, group, 'position')) call put(draft, group, 'stretch', ascending(2, 1.0_wp))
         call draw_short_course(draft, group)
      end do
      do k = 1, int(3.0_wp*number())
         group = 'base_'//to_text(k)
         call draw_short_course(draft, group)
         if (chance(0.4_wp)) call put(draft, group, 'quantity', '''displacement''')
         if (chance(0.3_wp)) call put(draft, group, 'gravity_ratio', to_text(between(0.01_wp, 1.0_wp, .true.)))
      end do
      if (chance(0.8_wp)) call draw_start(names, draft)
      if (has_name(draft, 'start', 'mode')) call put(draft, 'start', 'mode', to_text(1 + int(3.0_wp*number())))
      call put(draft, 'response', 'method', '''newmark''')
      call put(draft, 'response', 'newmark_scheme', trim(schemes(1 + int(4.0_wp*number()))))
      call put(draft, 'response', 'substep', '.true.')
      if (chance(0.4_wp)) then
         call put(draft, 'response', 'modes', to_text(3 + int(6.0_wp*number())))
      else if (chance(0.3_wp)) then
         call put(draft, 'response', 'keep_all_modes', '.true.')
      end if
      call put(draft, 'response', 'duration', to_text(between(0.5_wp, 8.0_wp, .true.)))
      if (chance(0.3_wp)) call put(draft, 'stress', 'position', list([number()]))
   end subroutine draw_steps

   !> None, one of either kind, both, or ratios of modes; none beyond critical damping.
   subroutine draw_damping(draft)
      type(draft_t), intent(inout) :: draft

      integer :: i, kind

      kind = int(5.0_wp*number())
      if (kind == 1 .or. kind == 3) call put(draft, 'damping', 'zeta', to_text(between(1.0e-4_wp, 0.02_wp, .true.)))
      if (kind == 2 .or. kind == 3) call put(draft, 'damping', 'zeta_mass', to_text(between(0.01_wp, 0.5_wp, .true.)))
      if (kind == 4) call put(draft, 'damping', 'mode_ratios', list([(between(0.001_wp, 0.5_wp, .true.), &
         i=1, 1 + int(4.0_wp*number()))]))
   end subroutine draw_damping

   !> A root that moves, supports, rigid or not, and a mass.
   subroutine draw_held(draft)
      type(draft_t), intent(inout) :: draft

      character(:), allocatable :: group
      integer :: k

      select case (int(8.0_wp*number()))
      case (0)
         call put(draft, 'root', 'kind', '''pinned''')
      case (1)
         call put(draft, 'root', 'rotation_stiffness_ratio', to_text(between(0.1_wp, 30.0_wp, .true.)))
      case (2)
         call put(draft, 'root', 'translation_stiffness_ratio', to_text(between(1.0_wp, 100.0_wp, .true.)))
         if (chance(0.5_wp)) call put(draft, 'root', 'rotation_stiffness_ratio', to_text(between(0.1_wp, 30.0_wp, .true.)))
      end select
      do k = 1, max(0, int(4.0_wp*number()) - 1)
         group = 'support_'//to_text(k)
         call put(draft, group, 'position', to_text(min(1.0_wp, between(0.2_wp, 1.2_wp, .false.))))
         if (chance(0.4_wp)) call put(draft, group, 'motion', '''rotation''')
         if (chance(0.4_wp)) call put(draft, group, 'stiffness_ratio', to_text(between(0.1_wp, 100.0_wp, .true.)))
      end do
      if (chance(0.8_wp)) return
      call put(draft, 'mass_1', 'position', to_text(between(0.2_wp, 1.0_wp, .false.)))
      call put(draft, 'mass_1', 'mass_ratio', to_text(between(0.01_wp, 2.0_wp, .true.)))
      if (chance(0.5_wp)) call put(draft, 'mass_1', 'rotary_inertia_ratio', to_text(between(0.001_wp, 0.1_wp, .true.)))
   end subroutine draw_held

   !> A course of any kind that changes within a short run.
   subroutine draw_short_course(draft, group)
      type(draft_t), intent(inout) :: draft
      character(*), intent(in) :: group

      character(*), parameter :: kinds(4) = [character(10) :: '''harmonic''', '''step''', '''pulse''', '''table''']

      call put(draft, group, 'kind', trim(kinds(1 + int(4.0_wp*number()))))
      if (value_of(draft, group, 'kind') == '''harmonic''') then
         call put(draft, group, 'frequency_ratio', to_text(between(0.1_wp, 10.0_wp, .true.)))
         call put(draft, group, 'phase', to_text(between(-180.0_wp, 180.0_wp, .false.)))
      else if (value_of(draft, group, 'kind') == '''pulse''') then
         if (chance(0.5_wp)) call put(draft, group, 'shape', '''half_sine''')
      end if
      if (chance(0.5_wp)) call put(draft, group, 'start', to_text(number()))
      if (chance(0.3_wp)) call put(draft, group, 'end', to_text(1.0_wp + 2.0_wp*number()))
      call draw_course(draft, group)
   end subroutine draw_short_course

   !> Give some of the ratios in the units of the scene instead.
   subroutine give_units(scene, draft)
      !> The scene as read from the draft
      type(scene_t), intent(in) :: scene
      !> The draft
      type(draft_t), intent(inout) :: draft

      real(wp) :: stiffness, lift, time

      associate (scales => scene%scales)
         stiffness = 3.0_wp*scales%bending_stiffness/scales%length**3
         time = 1.0_wp/scales%omega1
         lift = scales%length*10.0_wp**(-1.0_wp - 5.0_wp*number())/(1.0_wp + abs(scene%stop%preload))
         call instead('damping', 'zeta', 'stiffness_coefficient', 2.0_wp*scene%zeta*time)
         call instead('tip_mass', 'ratio', 'mass', scene%tip_mass_ratio*scales%beam_mass)
         if (allocated(scene%masses)) then
            call instead('mass_1', 'position', 'position_length', scene%masses(1)%position*scales%length)
            call instead('mass_1', 'mass_ratio', 'mass', scene%masses(1)%mass_ratio*scales%beam_mass)
            call instead('mass_1', 'rotary_inertia_ratio', 'rotary_inertia', &
               scene%masses(1)%rotary_inertia_ratio*scales%beam_mass*scales%length**2)
         end if
         call instead('root', 'rotation_stiffness_ratio', 'rotation_stiffness', &
            scene%root%rotation_stiffness_ratio*stiffness*scales%length**2)
         call instead('root', 'translation_stiffness_ratio', 'translation_stiffness', &
            scene%root%translation_stiffness_ratio*stiffness)
         call instead('stop', 'position', 'position_length', scene%stop%position*scales%length)
         call instead('stop', 'stiffness_ratio', 'stiffness', scene%stop%stiffness_ratio*stiffness)
         call instead('stop', 'branch_ratio', 'branch_stiffness', &
            scene%stop%branch_ratio*scene%stop%stiffness_ratio*stiffness)
         call instead('stop', 'damper_ratio', 'damper', scene%stop%damper_ratio*stiffness*time)
         if (scene%has_bodies) call give_units_of_body(scene%bodies(1), stiffness, time)
         call instead('relay', 'shortest_opening', 'shortest_opening_time', scene%relay%shortest_opening*time)
         if (has_name(draft, 'stress', 'position')) call instead_list('stress', 'position', 'position_length', &
            scene%stress%position*scales%length)
         call instead('response', 'duration', 'duration_time', scene%response%duration*time)
         call instead('response', 'step', 'step_time', scene%response%step*time)
         if (has_name(draft, 'frequency_response', 'frequency_ratio_range') .and. chance(0.7_wp)) then
            call drop(draft, 'frequency_response', 'frequency_ratio_range')
            call put(draft, 'frequency_response', 'frequency_range', list(scene%frequency_response%range &
               /(2.0_wp*acos(-1.0_wp)*time)))
         end if
         if (has_name(draft, 'spectrum', 'frequency_ratio_range') .and. chance(0.7_wp)) then
            call drop(draft, 'spectrum', 'frequency_ratio_range')
            call put(draft, 'spectrum', 'frequency_range', list(scene%spectrum%range/(2.0_wp*acos(-1.0_wp)*time)))
         end if
         if (scene%wants_spectrum) then
            call instead('spectrum', 'resolution_ratio', 'resolution', scene%spectrum%resolution &
               /(2.0_wp*acos(-1.0_wp)*time))
            call instead('spectrum', 'start', 'start_time', scene%spectrum%start*time)
            call instead('spectrum', 'end', 'end_time', end_time(scene%spectrum%end, time))
         end if
         if (scene%wants_statistics) then
            call instead('statistics', 'start', 'start_time', scene%statistics%start*time)
            call instead('statistics', 'end', 'end_time', end_time(scene%statistics%end, time))
            call instead('statistics', 'rest', 'rest_time', scene%statistics%rest*time)
         end if
         if (allocated(scene%supports)) then
            call instead('support_1', 'position', 'position_length', scene%supports(1)%position*scales%length)
            call instead('support_1', 'stiffness_ratio', 'stiffness', stiffness*scene%supports(1)%stiffness_ratio &
               *merge(scales%length**2, 1.0_wp, scene%supports(1)%motion == support_rotation))
         end if
         call instead('damping', 'zeta_mass', 'mass_coefficient', 2.0_wp*scene%zeta_mass/time)
         if (scene%start%kind /= start_release) call give_units_of_loads(scene, stiffness, lift, time)
         if (allocated(scene%more_stops)) return
         lift = lift*merge(-1.0_wp, 1.0_wp, scene%stop%side == side_above)
         call instead('stop', 'preload', 'surface_height', scene%stop%preload*lift)
         if (scene%stop%preload <= -0.5_wp) call instead('stop', 'clearance_ratio', 'clearance', -scene%stop%preload*lift)
         if (has_name(draft, 'stop', 'clearance')) &
            call put(draft, 'stop', 'initial_height', to_text((1.0_wp + scene%stop%preload)*lift))
         if (has_name(draft, 'stop', 'surface_height')) &
            call put(draft, 'stop', 'initial_height', to_text((1.0_wp + scene%stop%preload)*lift))
      end associate

   contains

      !> What the first body has besides lengths over the unit of displacement.
      subroutine give_units_of_body(body, stiffness, time)
         type(body_settings_t), intent(in) :: body
         !> 3 E Ibar / L^3, and 1/omega1
         real(wp), intent(in) :: stiffness
         real(wp), intent(in) :: time

         type(stop_settings_t) :: stop
         character(:), allocatable :: prefix
         integer :: k

         call instead('body_1', 'position', 'position_length', body%position*scene%scales%length)
         call instead('body_1', 'mass_ratio', 'mass', body%mass_ratio*scene%scales%beam_mass)
         call instead('body_1', 'spring_ratio', 'spring', body%spring_ratio*stiffness)
         call instead('body_1', 'base_damper_ratio', 'base_damper', body%base_damper_ratio*stiffness*time)
         do k = 1, 2
            stop = merge(body%contact, body%base_contact, k == 1)
            prefix = trim(floors(k))
            call instead('body_1', prefix//'stiffness_ratio', prefix//'stiffness', stop%stiffness_ratio*stiffness)
            call instead('body_1', prefix//'branch_ratio', prefix//'branch_stiffness', &
               stop%branch_ratio*stop%stiffness_ratio*stiffness)
            call instead('body_1', prefix//'damper_ratio', prefix//'damper', stop%damper_ratio*stiffness*time)
         end do
      end subroutine give_units_of_body

      !> Loads and start; the unit of displacement is told.
      subroutine give_units_of_loads(scene, stiffness, length, time)
         type(scene_t), intent(in) :: scene
         !> 3 E Ibar / L^3, D, and 1/omega1
         real(wp), intent(in) :: stiffness
         real(wp), intent(in) :: length
         real(wp), intent(in) :: time

         real(wp) :: unit

         call put(draft, 'scene', 'displacement_scale', to_text(length))
         unit = lambda1_power4*length*scene%scales%bending_stiffness/(scene%scales%height_ratio*scene%scales%length**3)
         call instead('statistics', 'threshold_ratio', 'force_threshold', scene%statistics%threshold*unit)
         call instead('relay', 'lasting_force_ratio', 'lasting_force', scene%relay%lasting_force*unit)
         call instead('stress', 'fatigue_threshold_ratio', 'fatigue_threshold', scene%stress%fatigue_threshold &
            *scene%scales%youngs_modulus*length/scene%scales%length)
         if (allocated(scene%forces)) then
            unit = stiffness*length
            if (.not. allocated(scene%forces(1)%position)) unit = unit/scene%scales%length
            call give_units_of_course('force_1', scene%forces(1)%course)
            if (scene%forces(1)%course%kind /= course_table) call instead('force_1', 'amplitude_ratio', 'amplitude', &
               scene%forces(1)%course%amplitude*unit)
            if (has_name(draft, 'force_1', 'position')) then
               call instead_list('force_1', 'position', 'position_length', scene%forces(1)%position*scene%scales%length)
            else
               call instead_list('force_1', 'stretch', 'stretch_length', scene%forces(1)%stretch*scene%scales%length)
            end if
         end if
         if (allocated(scene%bases)) then
            unit = length/time**2
            call give_units_of_course('base_1', scene%bases(1)%course)
            call instead('base_1', 'gravity_ratio', 'gravity', scene%bases(1)%gravity_ratio*unit)
            if (scene%bases(1)%quantity == base_displacement) unit = length
            if (scene%bases(1)%course%kind /= course_table) call instead('base_1', 'amplitude_ratio', 'amplitude', &
               scene%bases(1)%course%amplitude*unit)
         end if
         if (scene%has_bodies) then
            associate (body => scene%bodies(1))
               call instead('body_1', 'start_velocity_ratio', 'start_velocity', body%start_velocity*length/time)
               call instead('body_1', 'clearance_ratio', 'clearance', body%clearance*length)
               call instead('body_1', 'rest_ratio', 'rest', body%rest*length)
               call instead('body_1', 'start_gap_ratio', 'start_gap', body%start_gap*length)
               call instead('body_1', 'floor_ratio', 'floor', body%floor*length)
               call instead('body_1', 'ceiling_ratio', 'ceiling', body%ceiling*length)
            end associate
         end if
         associate (start => scene%start)
            call instead('start', 'velocity_ratio', 'velocity', start%velocity*length/time)
            call instead('start', 'displacement_ratio', 'displacement', start%displacement*length)
            call instead('start', 'height_ratio', 'height', start%height_ratio*length)
            if (has_name(draft, 'start', 'displacement_ratios')) then
               call drop(draft, 'start', 'displacement_ratios')
               call put(draft, 'start', 'displacements', list(start%displacements*length))
            end if
            if (has_name(draft, 'start', 'velocity_ratios')) then
               call drop(draft, 'start', 'velocity_ratios')
               call put(draft, 'start', 'velocities', list(start%velocities*length/time))
            end if
         end associate
      end subroutine give_units_of_loads

      !> Times and frequency of a load.
      subroutine give_units_of_course(group, course)
         character(*), intent(in) :: group
         type(time_course_t), intent(in) :: course

         real(wp) :: time

         time = 1.0_wp/scene%scales%omega1
         call instead(group, 'frequency_ratio', 'frequency', course%frequency/time/(2.0_wp*acos(-1.0_wp)))
         call instead(group, 'start', 'start_time', course%start*time)
         call instead(group, 'end', 'end_time', end_time(course%end, time))
         call instead(group, 'duration', 'duration_time', course%duration*time)
      end subroutine give_units_of_course

      !> One of them, most of the time.
      subroutine instead(group, ratio, quantity, value)
         !> Where it stands
         character(*), intent(in) :: group
         character(*), intent(in) :: ratio
         !> What stands for it, and its value
         character(*), intent(in) :: quantity
         real(wp), intent(in) :: value

         call instead_list(group, ratio, quantity, [value])
      end subroutine instead

      !> The same of a list.
      subroutine instead_list(group, ratio, quantity, values)
         character(*), intent(in) :: group
         character(*), intent(in) :: ratio
         character(*), intent(in) :: quantity
         real(wp), intent(in) :: values(:)

         if (.not. has_name(draft, group, ratio) .or. chance(0.3_wp)) return
         call drop(draft, group, ratio)
         call put(draft, group, quantity, list(values))
      end subroutine instead_list

   end subroutine give_units

   !> The end of a window or load, which without a value in the scene is as late as can be.
   pure real(wp) function end_time(end, unit)
      !> The end in units of time
      real(wp), intent(in) :: end
      !> The unit, s
      real(wp), intent(in) :: unit

      end_time = min(end, 0.5_wp*huge(end)/max(1.0_wp, unit))*unit
   end function end_time

   !> The ratios that a scene in units was given, to the last bit.
   subroutine take_ratios(scene, draft)
      !> The scene as read in units
      type(scene_t), intent(in) :: scene
      !> The draft in ratios
      type(draft_t), intent(inout) :: draft

      if (has_name(draft, 'frequency_response', '')) call put(draft, 'frequency_response', 'frequency_ratio_range', &
         list(scene%frequency_response%range))
      if (has_name(draft, 'spectrum', '')) then
         call put(draft, 'spectrum', 'frequency_ratio_range', list(scene%spectrum%range))
         call take('spectrum', 'resolution_ratio', scene%spectrum%resolution)
         call take('spectrum', 'start', scene%spectrum%start)
         call take('spectrum', 'end', scene%spectrum%end)
      end if
      call take('damping', 'zeta', scene%zeta)
      call take('tip_mass', 'ratio', scene%tip_mass_ratio)
      if (allocated(scene%masses)) then
         call take('mass_1', 'position', scene%masses(1)%position)
         call take('mass_1', 'mass_ratio', scene%masses(1)%mass_ratio)
         call take('mass_1', 'rotary_inertia_ratio', scene%masses(1)%rotary_inertia_ratio)
      end if
      if (scene%has_bodies) call take_body(scene%bodies(1))
      call take('root', 'rotation_stiffness_ratio', scene%root%rotation_stiffness_ratio)
      call take('root', 'translation_stiffness_ratio', scene%root%translation_stiffness_ratio)
      call take('stop', 'position', scene%stop%position)
      call take('stop', 'stiffness_ratio', scene%stop%stiffness_ratio)
      call take('stop', 'branch_ratio', scene%stop%branch_ratio)
      call take('stop', 'damper_ratio', scene%stop%damper_ratio)
      if (scene%stop%side == side_both) call take('stop', 'clearance_ratio', -scene%stop%preload)
      if (scene%stop%side /= side_both) call take('stop', 'preload', scene%stop%preload)
      if (allocated(scene%supports)) then
         call take('support_1', 'position', scene%supports(1)%position)
         call take('support_1', 'stiffness_ratio', scene%supports(1)%stiffness_ratio)
      end if
      call take('damping', 'zeta_mass', scene%zeta_mass)
      if (allocated(scene%forces)) then
         call take_course('force_1', scene%forces(1)%course)
         if (has_name(draft, 'force_1', 'position')) call put(draft, 'force_1', 'position', list(scene%forces(1)%position))
         if (has_name(draft, 'force_1', 'stretch')) call put(draft, 'force_1', 'stretch', list(scene%forces(1)%stretch))
      end if
      if (allocated(scene%bases)) then
         call take_course('base_1', scene%bases(1)%course)
         call take('base_1', 'gravity_ratio', scene%bases(1)%gravity_ratio)
      end if
      call take('start', 'velocity_ratio', scene%start%velocity)
      call take('start', 'displacement_ratio', scene%start%displacement)
      call take('start', 'height_ratio', scene%start%height_ratio)
      if (has_name(draft, 'start', 'displacement_ratios')) call put(draft, 'start', 'displacement_ratios', &
         list(scene%start%displacements))
      if (has_name(draft, 'start', 'velocity_ratios')) call put(draft, 'start', 'velocity_ratios', &
         list(scene%start%velocities))
      call take('response', 'duration', scene%response%duration)
      call take('response', 'step', scene%response%step)
      if (scene%wants_statistics) then
         call take('statistics', 'start', scene%statistics%start)
         call take('statistics', 'end', scene%statistics%end)
         call take('statistics', 'rest', scene%statistics%rest)
         call take('statistics', 'threshold_ratio', scene%statistics%threshold)
      end if
      call take('relay', 'lasting_force_ratio', scene%relay%lasting_force)
      call take('relay', 'shortest_opening', scene%relay%shortest_opening)
      if (has_name(draft, 'stress', 'position')) call put(draft, 'stress', 'position', list(scene%stress%position))
      call take('stress', 'fatigue_threshold_ratio', scene%stress%fatigue_threshold)

   contains

      subroutine take_body(body)
         type(body_settings_t), intent(in) :: body

         type(stop_settings_t) :: stop
         character(:), allocatable :: prefix
         integer :: k

         call take('body_1', 'position', body%position)
         call take('body_1', 'mass_ratio', body%mass_ratio)
         call take('body_1', 'spring_ratio', body%spring_ratio)
         call take('body_1', 'base_damper_ratio', body%base_damper_ratio)
         call take('body_1', 'start_velocity_ratio', body%start_velocity)
         call take('body_1', 'clearance_ratio', body%clearance)
         call take('body_1', 'rest_ratio', body%rest)
         call take('body_1', 'start_gap_ratio', body%start_gap)
         call take('body_1', 'floor_ratio', body%floor)
         call take('body_1', 'ceiling_ratio', body%ceiling)
         do k = 1, 2
            stop = merge(body%contact, body%base_contact, k == 1)
            prefix = trim(floors(k))
            call take('body_1', prefix//'stiffness_ratio', stop%stiffness_ratio)
            call take('body_1', prefix//'branch_ratio', stop%branch_ratio)
            call take('body_1', prefix//'damper_ratio', stop%damper_ratio)
         end do
      end subroutine take_body

      subroutine take_course(group, course)
         character(*), intent(in) :: group
         type(time_course_t), intent(in) :: course

         call take(group, 'amplitude_ratio', course%amplitude)
         call take(group, 'frequency_ratio', course%frequency)
         call take(group, 'start', course%start)
         call take(group, 'end', course%end)
         call take(group, 'duration', course%duration)
      end subroutine take_course

      !> One of them.
      subroutine take(group, ratio, value)
         !> Where it stands
         character(*), intent(in) :: group
         character(*), intent(in) :: ratio
         !> Its value
         real(wp), intent(in) :: value

         if (has_name(draft, group, ratio)) call put(draft, group, ratio, to_text(value))
      end subroutine take

   end subroutine take_ratios

end module scene_drawing
