!> Checks of &sweep and &cases, including sweeps with chains, sequences of cases of which each starts from the final
!> state of the preceding one.
module scene_sweep
   use kinds, only: i8, wp
   use load_settings, only: is_steady
   use measure_list, only: demand_of, measure_force, measure_mean_force, measure_table
   use name_hints, only: phrase_of
   use name_table, only: table_t
   use name_types, only: is_among, max_length_ratio, max_stored_numbers, length_ratio_problem
   use number_text, only: rounded, to_text
   use scene_beam, only: min_tip_ratio
   use scene_input, only: scene_input_t
   use scene_types, only: has_rigid_stops, scene_t
   use sweep_names, only: chosen_parameter, max_cases
   use sweep_settings, only: design_grid, design_latin_hypercube, design_paired, is_follower, is_swept, parameter_t, &
      parameter_index, &
      swept_t, value_count_of, values_given
   implicit none (type, external)
   private
   public :: resolve_sweep, resolve_cases, entry_of_parameter, refuse_lost_values

   !> Pairs of a ratio and a quantity in units that refers to it: if the ratio is varied, the quantity no longer has the
   !> value in the file.
   character(*), parameter :: lost_quantities(2, 2) = reshape([character(32) :: 'stiffness_ratio', 'branch_stiffness', &
      'stiffness_ratio', 'damper'], [2, 2])

contains

   !> Check that the values in &sweep and &best are consistent. Problems are reported to `input`.
   subroutine resolve_sweep(input, table, scene)
      type(scene_input_t), intent(inout) :: input
      !> Table of names with the values of the file
      type(table_t), intent(in) :: table
      !> Scene that is resolved except for the sweep
      type(scene_t), intent(inout) :: scene

      integer :: k

      if (.not. scene%wants_sweep) return
      do k = 1, size(scene%sweep%swept)
         call check_values(input, scene%sweep%design, scene%sweep%swept(k))
         if (input%has_problem()) return
      end do
      if (.not. any(is_swept(scene%sweep%swept))) then
         call input%complain('sweep', '', &
            'varies nothing; give a parameter a list or a range, such as zeta = 0.01, 0.02')
         return
      end if
      call check_duplicates(input, table, scene%sweep%swept)
      do k = 1, size(scene%sweep%swept)
         associate (swept => scene%sweep%swept(k))
            if (is_swept(swept)) call refuse_lost_values(input, table, entry_of_parameter(table, swept%parameter), &
               '&sweep '//given_name(swept))
         end associate
      end do
      if (scene%sweep%design == design_latin_hypercube .and. scene%sweep%count == 0) then
         call input%complain('sweep', 'design', 'needs count, the number of cases')
      end if
      call check_ties(input, scene)
      if (scene%wants_best) then
         associate (swept => scene%sweep%swept)
            if (scene%best%refine .and. any(is_swept(swept) .and. swept%parameter%group == 'response' .and. &
               index(swept%parameter%name_in_group, 'duration') == 1)) call input%complain('best', 'refine', &
               'does not go with a duration in &sweep: it would find the run that ends soonest')
         end associate
         if (scene%best%measure == measure_force .and. has_rigid_stops(scene)) scene%best%measure = measure_mean_force
         associate (group => measure_table(scene%best%measure)%group)
            if (.not. scene%has_group(group)) call input%complain('best', 'measure', demand_of(group))
         end associate
      end if
      if (scene%wants_spectrum .and. any(is_swept(scene%sweep%swept) .and. &
         scene%sweep%swept%parameter%changes_scales)) call input%complain('spectrum', '', 'of a sweep has the same ' &
         //'frequencies for all cases; it does not go with lengths, section or material of the beam in &sweep')
      call check_count(input, scene)
      call check_beams(input, scene)
      ! each duration is at least one step and not too many steps
      associate (duration => scene%sweep%swept(parameter_index('duration', scene%sweep%swept)))
         if (any(values_given(duration) < scene%response%step)) then
            call input%complain('sweep', given_name(duration), 'must not be shorter than the step ' &
               //to_text(scene%response%step))
         else if (any(values_given(duration) > max_stored_numbers*scene%response%step)) then
            call input%complain('sweep', given_name(duration), 'must be at most '//to_text(max_stored_numbers) &
               //' steps')
         end if
      end associate
      if (.not. input%has_problem()) call check_chains(input, scene)
   end subroutine resolve_sweep

   !> Check that no parameter is varied both as a ratio and in units, or together with a name that excludes it. Problems
   !> are reported to `input`.
   subroutine check_duplicates(input, table, swept)
      type(scene_input_t), intent(inout) :: input
      !> Table of names with the values of the file
      type(table_t), intent(in) :: table
      type(swept_t), intent(in) :: swept(:)

      integer :: i, k

      do k = 1, size(swept)
         if (.not. is_swept(swept(k))) cycle
         associate (varied => swept(k)%parameter, entry => table%entries(entry_of_parameter(table, swept(k)%parameter)))
            do i = 1, size(swept)
               if (.not. is_swept(swept(i)) .or. swept(i)%parameter%group /= varied%group) cycle
               if (swept(i)%parameter%occurrence /= varied%occurrence) cycle
               if (varied%quantity /= '' .and. swept(i)%parameter%name_in_group == entry%name%instead_of) then
                  call input%complain('sweep', given_name(swept(k)), 'give '//trim(varied%name)//' or ' &
                     //trim(swept(i)%parameter%name)//', not both')
               else if (is_among(swept(i)%parameter%name_in_group, entry%name%needs%without)) then
                  call input%complain('sweep', given_name(swept(k)), 'does not go with ' &
                     //trim(swept(i)%parameter%name))
               end if
               if (input%has_problem()) return
            end do
         end associate
      end do
   end subroutine check_duplicates

   !> Check that the values of one parameter are given as a list or a range, as the design of the sweep requires.
   subroutine check_values(input, design, swept)
      type(scene_input_t), intent(inout) :: input
      !> One of the `design_` constants
      integer, intent(in) :: design
      type(swept_t), intent(in) :: swept

      character(:), allocatable :: name
      logical :: has_list, has_range, has_log

      name = trim(swept%parameter%name)
      has_list = allocated(swept%list)
      has_range = allocated(swept%range)
      has_log = allocated(swept%log_range)
      if (count([has_list, has_range, has_log]) > 1) then
         call input%complain('sweep', given_name(swept), &
            'give one of '//name//', '//name//'_range and '//name//'_log_range')
         return
      end if
      if (has_range) call check_range(input, name//'_range', swept%range)
      if (has_log) call check_range(input, name//'_log_range', swept%log_range)
      if (input%has_problem()) return
      if (has_log) then
         if (swept%log_range(1) <= 0.0_wp) then
            call input%complain('sweep', name//'_log_range', 'must be above 0: it is divided in the logarithm')
         end if
      end if
      if (swept%points > 0 .and. .not. (has_range .or. has_log)) then
         call input%complain('sweep', name//'_points', 'goes with '//name//'_range or '//name//'_log_range')
      end if
      select case (design)
      case (design_grid)
         if ((has_range .or. has_log) .and. swept%points == 0) call input%complain('sweep', &
            given_name(swept), 'needs '//name//'_points too')
      case (design_paired)
         if (has_range .or. has_log) call input%complain('sweep', &
            given_name(swept), "design = 'paired' takes lists: give "//name)
      case (design_latin_hypercube)
         if (has_list) call input%complain('sweep', name, "design = 'latin_hypercube' takes ranges")
         if (swept%points > 0) call input%complain('sweep', name//'_points', &
            "does not go with design = 'latin_hypercube', which has a value for each case")
      end select
   end subroutine check_values

   !> Check that a range has two ascending values.
   subroutine check_range(input, name, range)
      type(scene_input_t), intent(inout) :: input
      character(*), intent(in) :: name
      real(wp), intent(in) :: range(:)

      if (size(range) /= 2) then
         call input%complain('sweep', name, 'takes two values, the minimum and the maximum')
      else if (.not. range(2) > range(1)) then
         call input%complain('sweep', name, 'the first value must be less than the second')
      end if
   end subroutine check_range

   !> Check that paired lists are equally long, and that the number of cases is within the limit.
   subroutine check_count(input, scene)
      type(scene_input_t), intent(inout) :: input
      type(scene_t), intent(in) :: scene

      ! name of the last paired parameter whose list was compared; empty: none
      character(:), allocatable :: compared
      ! number of cases, in a grid limited so that the product does not overflow
      integer(i8) :: cases
      ! number of values of one parameter
      integer(i8) :: values
      integer :: k

      cases = 1_i8
      compared = ''
      do k = 1, size(scene%sweep%swept)
         associate (swept => scene%sweep%swept(k))
            values = int(value_count_of(scene%sweep, k), i8)
            if (scene%sweep%design == design_grid .and. .not. is_follower(scene%sweep, k)) then
               cases = min(cases*values, 2_i8*max_cases)
            end if
            if (scene%sweep%design /= design_paired .or. .not. allocated(swept%list)) cycle
            if (compared /= '' .and. values /= cases) then
               call input%complain('sweep', trim(swept%parameter%name), &
                  "design = 'paired' takes lists of one length; " &
                  //compared//' has '//to_text(cases)//' values, this '//to_text(values))
               return
            end if
            compared = trim(swept%parameter%name)
            cases = values
         end associate
      end do
      if (cases > int(max_cases, i8)) call input%complain('sweep', '', 'has more than '//to_text(max_cases)//' cases')
   end subroutine check_count

   !> Check that parameters that vary together are swept in a grid, with equally many values.
   subroutine check_ties(input, scene)
      type(scene_input_t), intent(inout) :: input
      type(scene_t), intent(in) :: scene

      integer, allocatable :: values(:)
      integer :: k

      associate (sweep => scene%sweep)
         if (.not. allocated(sweep%tied)) return
         allocate (values(size(sweep%tied)))
         do k = 1, size(values)
            values(k) = sweep%swept(sweep%tied(k))%points
            if (allocated(sweep%swept(sweep%tied(k))%list)) values(k) = size(sweep%swept(sweep%tied(k))%list)
         end do
         if (sweep%design /= design_grid) then
            call input%complain('sweep', 'tied', "goes with design = 'grid'; design = 'paired' ties all lists")
         else if (size(values) < 2) then
            call input%complain('sweep', 'tied', "takes two or more parameters, such as 'position', 'preload'")
         else if (.not. all(is_swept(sweep%swept(sweep%tied)))) then
            call input%complain('sweep', 'tied', trim(sweep%swept(sweep%tied(findloc(is_swept( &
               sweep%swept(sweep%tied)), .false., dim=1)))%parameter%name)//' must be swept: give it a list or a range')
         else if (any(values /= values(1))) then
            k = findloc(values /= values(1), .true., dim=1)
            call input%complain('sweep', 'tied', 'takes parameters with equally many values; ' &
               //trim(sweep%swept(sweep%tied(1))%parameter%name)//' has '//to_text(values(1))//', ' &
               //trim(sweep%swept(sweep%tied(k))%parameter%name)//' '//to_text(values(k)))
         else if (sweep%carry > 0) then
            call input%complain('sweep', 'tied', 'does not go with carry')
         else if (scene%wants_best .and. scene%best%refine) then
            call input%complain('sweep', 'tied', 'does not go with refine of &best')
         end if
      end associate
   end subroutine check_ties

   !> Check that the tapers of all cases give positive heights, and their meshes an allowed ratio of longest to shortest
   !> element.
   subroutine check_beams(input, scene)
      type(scene_input_t), intent(inout) :: input
      type(scene_t), intent(in) :: scene

      ! tapers of the cases
      real(wp), allocatable :: values(:)
      ! maximum number of elements
      real(wp) :: elements
      ! mean height over length
      real(wp) :: mean
      ! decimal logarithm of the maximum ratio of the longest to the shortest element
      real(wp) :: decades
      integer :: i

      associate (swept => scene%sweep%swept)
         allocate (values, source=values_given(swept(parameter_index('taper', swept))))
         elements = maxval(values_given(swept(parameter_index('elements', swept)), real(scene%mesh%elements, wp)))
         decades = (elements - 1.0_wp) &
            *maxval(abs(log10(values_given(swept(parameter_index('mesh_ratio', swept)), scene%mesh%ratio))))
      end associate
      if (size(values) > 0 .and. scene%beam%has_section) then
         call input%complain('section', '', 'says all of the section: a taper of &beam is not swept beside it')
         return
      end if
      mean = 0.5_wp*(scene%beam%height_root + scene%beam%height_tip)/scene%beam%length
      do i = 1, size(values)
         if (values(i) > -2.0_wp*mean .and. abs(values(i)) <= 2.0_wp*mean*(1.0_wp - min_tip_ratio)) cycle
         ! a full wedge, except for rounding
         if (abs(values(i) - 2.0_wp*mean) <= 4.0_wp*epsilon(mean)*mean) cycle
         call input%complain('sweep', given_name(scene%sweep%swept(parameter_index('taper', scene%sweep%swept))), &
            'taper = ' &
            //to_text(values(i))//': the height at the clamp must not vanish, at the tip it must be 0 or at least ' &
            //to_text(min_tip_ratio)//' of that; so at most '//to_text(2.0_wp*mean)//' in size (a full wedge)')
         return
      end do
      if (decades > log10(max_length_ratio)) call input%complain('sweep', 'elements', 'with '//to_text(nint(elements)) &
         //' elements and the ratios given '//length_ratio_problem(decades, max_length_ratio))
   end subroutine check_beams

   !> Index of the entry of a parameter in its own group.
   pure integer function entry_of_parameter(table, parameter) result(place)
      type(table_t), intent(in) :: table
      type(parameter_t), intent(in) :: parameter

      place = table%find(table%find_group(trim(parameter%group), parameter%occurrence), trim(parameter%name_in_group))
   end function entry_of_parameter

   !> The name in &sweep that gives the values of a parameter.
   pure function given_name(swept) result(given)
      type(swept_t), intent(in) :: swept
      character(:), allocatable :: given

      given = trim(swept%parameter%name)
      if (allocated(swept%range)) then
         given = given//'_range'
      else if (allocated(swept%log_range)) then
         given = given//'_log_range'
      end if
   end function given_name

   !> Check a sweep with chains: its parameters must be able to change during a motion. Problems are reported to
   !> `input`.
   subroutine check_chains(input, scene)
      type(scene_input_t), intent(inout) :: input
      !> Resolved scene
      type(scene_t), intent(in) :: scene

      integer :: k

      associate (sweep => scene%sweep)
         if (sweep%carry == 0) then
            if (sweep%carries_back) call input%complain('sweep', 'carry_back', &
               'needs carry, the parameter along whose values cases go on')
            return
         end if
         if (.not. is_swept(sweep%swept(sweep%carry))) then
            call input%complain('sweep', 'carry', 'must be swept: give it a list or a range')
         else if (sweep%design == design_latin_hypercube) then
            call input%complain('sweep', 'carry', "does not go with design = 'latin_hypercube', which has no order")
         else if (.not. scene%wants_poincare) then
            call input%complain('sweep', 'carry', 'needs &poincare: cases last whole periods of the load')
         end if
         if (input%has_problem()) return
         do k = 1, size(sweep%swept)
            if (.not. is_swept(sweep%swept(k)) .or. (k /= sweep%carry .and. sweep%design == design_grid)) cycle
            if (sweep%swept(k)%parameter%may_change_in_motion) cycle
            call input%complain('sweep', 'carry', trim(sweep%swept(k)%parameter%name)//' cannot change in a motion ' &
               //'under way: '//reason(sweep%swept(k)%parameter))
            return
         end do
      end associate
      call check_chain_loads(input, scene)
   end subroutine check_chains

   !> Check a sweep with chains: cases must last whole periods of loads without end, and no request may require separate
   !> runs of cases.
   subroutine check_chain_loads(input, scene)
      type(scene_input_t), intent(inout) :: input
      type(scene_t), intent(in) :: scene

      character(*), parameter :: not_with_carry = 'does not go with carry of &sweep'
      integer :: k

      if (.not. scene%poincare%sets_duration) then
         call input%complain('response', 'duration duration_time', &
            not_with_carry//', whose cases last skip + keep periods of the load')
      else if (scene%poincare%load > 0) then
         call input%complain('poincare', 'load', not_with_carry//': a case ends with a period of all loads')
      else if (scene%wants_best .and. scene%best%refine) then
         call input%complain('best', 'refine', not_with_carry//': its cases would begin by themselves')
      else if (scene%mesh%estimate) then
         call input%complain('mesh', 'estimate', not_with_carry//': its cases would begin by themselves')
      end if
      if (scene%has_forces) then
         do k = 1, size(scene%forces)
            if (.not. is_steady(scene%forces(k)%course)) call complain_of('force')
         end do
      end if
      if (scene%has_bases) then
         do k = 1, size(scene%bases)
            if (.not. is_steady(scene%bases(k)%course)) call complain_of('base')
         end do
      end if

   contains

      !> Report a load that begins after tau = 0, or ends before the end of the run.
      subroutine complain_of(group)
         character(*), intent(in) :: group

         if (input%has_problem()) return
         call input%complain(group, '', 'carry of &sweep takes loads without end: ' &
            //"kind = 'harmonic' or 'step' without start and end; this is "//group//' '//to_text(k), k)
      end subroutine complain_of
   end subroutine check_chain_loads

   !> Reason why the value of a parameter cannot change during a motion.
   pure function reason(parameter) result(words)
      type(parameter_t), intent(in) :: parameter
      character(:), allocatable :: words

      if (parameter%changes_beam) then
         words = 'another beam or mesh has other modes'
      else if (parameter%group == 'stop') then
         words = 'a surface elsewhere would be in the beam, or away from it'
      else if (any(parameter%group == [character(5) :: 'force', 'base'])) then
         words = 'loads go on in phase and in place, only amplitude and frequency change'
      else
         words = 'it says how a case begins or ends, or what is kept of it'
      end if
   end function reason

   !> Check that the parameter and the values of &cases are valid, and make them the sweep of the scene. Problems are
   !> reported to `input`.
   subroutine resolve_cases(input, table, scene)
      type(scene_input_t), intent(inout) :: input
      !> Table of names with the values of the file
      type(table_t), intent(in) :: table
      !> On entry resolved except for the cases; on return with a sweep of their parameter
      type(scene_t), intent(inout) :: scene

      if (.not. scene%wants_cases) return
      if (scene%cases%parameter%name == '') then
         call input%complain('cases', '', 'needs a parameter, which differs between cases')
      else if (.not. allocated(scene%cases%list)) then
         call input%complain('cases', '', 'needs values, one for each case')
      else if (scene%cases%parameter%is_whole .and. any(abs(scene%cases%list - anint(scene%cases%list)) > 0.0_wp)) then
         call input%complain('cases', 'values', trim(scene%cases%parameter%name)//' takes whole numbers')
      else
         call check_parameter(input, table, trim(scene%cases%parameter%name))
         if (scene%cases%parameter%name == 'taper' .and. .not. input%has_problem()) then
            if (scene%beam%has_section) then
               call input%complain('section', '', 'says all of the section: a taper of &beam is not varied beside it')
            else if (any(abs(scene%cases%list) > 2.0_wp*scene%scales%height_ratio*(1.0_wp + epsilon(1.0_wp)))) then
               ! a greater taper would give negative heights
               call input%complain('cases', 'values', 'a taper must be at most ' &
                  //rounded(2.0_wp*scene%scales%height_ratio) &
                  //' in size, twice the mean height over the length (a full wedge)')
            end if
         end if
         scene%sweep%swept = [scene%cases]
      end if
   end subroutine resolve_cases

   !> Check that the parameter applies in the scene, and that the file does not give the same quantity in units, because
   !> the cases would ignore that value. The cases replace a value that the parameter has in its own group, as in a
   !> sweep.
   subroutine check_parameter(input, table, parameter)
      type(scene_input_t), intent(inout) :: input
      !> Table of names with the values of the file
      type(table_t), intent(in) :: table
      !> Name of the parameter in &cases
      character(*), intent(in) :: parameter

      integer :: place

      place = chosen_parameter(table, table%find_group('cases'), 'parameter')
      associate (group => table%groups(table%entries(place)%group))
         if ((group%repeats .or. group%name == 'stress') .and. .not. group%is_wanted) call input%complain('cases', &
            'parameter', parameter//' goes with &'//trim(group%name))
      end associate
      if (.not. table%applies(place)) call input%complain('cases', 'parameter', &
         parameter//' goes with '//phrase_of(table, place, from_elsewhere=.true.))
      call refuse_lost_values(input, table, place, "&cases parameter = '"//parameter//"'")
   end subroutine check_parameter

   !> Report each quantity in the file whose value would not hold, because the varied entry determines the same
   !> quantity, or a quantity to which it refers (`lost_quantities`), and a list of points, all of which the varied
   !> entry would replace by one. A varied dimension of &section, or damping ratio, applies to all stations or modes.
   subroutine refuse_lost_values(input, table, place, by)
      type(scene_input_t), intent(inout) :: input
      !> Table of names with the values of the file
      type(table_t), intent(in) :: table
      !> Index of the entry that is varied
      integer, intent(in) :: place
      !> Name that varies the entry, for the message
      character(*), intent(in) :: by

      integer :: i, k
      logical :: is_lost

      associate (varied => table%entries(place), own => table%groups(table%entries(place)%group))
         if (varied%is_given .and. varied%is_list .and. any(own%name == [character(6) :: 'force', 'stress'])) then
            if (size(varied%list) > 1) call input%complain(trim(own%name), trim(varied%name%name), 'must be one ' &
               //'value beside '//by//', which would replace all '//to_text(size(varied%list))//' by one', &
               own%occurrence)
         end if
         do i = table%groups(varied%group)%first_entry, table%groups(varied%group)%last_entry
            associate (other => table%entries(i))
               if (.not. other%is_given) cycle
               is_lost = other%name%instead_of == varied%name%name .or. &
                  (varied%name%quantity /= '' .and. varied%name%instead_of == other%name%name)
               do k = 1, size(lost_quantities, 2)
                  is_lost = is_lost .or. (lost_quantities(1, k) == varied%name%name .and. lost_quantities(2, &
                     k) == other%name%name)
               end do
               if (is_lost) call input%complain(trim(table%groups(other%group)%name), trim(other%name%name), &
                  'does not go with '//by, table%groups(other%group)%occurrence)
            end associate
         end do
      end associate
   end subroutine refuse_lost_values

end module scene_sweep
