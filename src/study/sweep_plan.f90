!> The plan of a sweep: the number of its cases, their parameters, and the chunks (sets of successive cases) in which
!> results are written to disk.
module sweep_plan
   use case_runs, only: case_interface
   use checksums, only: checksum_of_numbers
   use kinds, only: i8, wp
   use measure_list, only: measure_count, measure_table
   use number_text, only: to_text
   use program_identity, only: program_name, program_version
   use random_numbers, only: next_random, random_t, shuffle, start_random
   use run_settings, only: method_newmark, stops_of
   use scene_beam_model, only: run_settings_of
   use scene_types, only: scene_t
   use sweep_settings, only: design_grid, design_latin_hypercube, is_follower, is_swept, parameter_t, &
      sweep_settings_t, values_given
   use sweep_spectra, only: spectrum_size
   implicit none (type, external)
   private
   public :: plan_t, axis_t, section_values, make_plan, cases_of_chunk, case_values, first_of_chunk
   public :: is_at_end, last_of_chunk, plan_text, value_at_fraction, fraction_at_value

   !> Number of values recorded in a Poincare section: displacement and velocity at the stop from which the beam is
   !> released, and at the tip.
   integer, parameter :: section_values = 4

   !> A parameter of the sweep and its values.
   type :: axis_t
      type(parameter_t) :: parameter
      !> Values: in a grid those of the axis, otherwise one value for each case
      real(wp), allocatable :: values(:)
      !> Minimum value
      real(wp) :: minimum = 0.0_wp
      !> Maximum value
      real(wp) :: maximum = 0.0_wp
      !> Whether the values from minimum to maximum are evenly spaced on a logarithmic scale
      logical :: is_logarithmic = .false.
      !> Distribution of the values, in words; empty: they are evenly spaced
      character(40) :: distribution = ''
      !> Index of the axis whose values this axis follows, value by value; 0: it is an axis of its own
      integer :: leader = 0
   end type axis_t

   !> The plan of a sweep.
   type :: plan_t
      !> Number of cases
      integer :: cases = 0
      !> Whether the cases are all combinations of the values, and the last axis varies fastest
      logical :: is_grid = .false.
      !> Parameters that are varied
      type(axis_t), allocatable :: axes(:)
      !> Number of cases in a chunk
      integer :: chunk_cases = 0
      !> Number of chunks
      integer :: chunks = 0
      !> Number of cases in a chain, a sequence of cases of which each starts from the final state of the preceding
      !> case; a chunk has whole chains. 0: the cases are independent
      integer :: chain = 0
      !> Whether the second half of a chain has the values of the first half in reverse order
      logical :: goes_back = .false.
      !> Number of Poincare sections recorded for each case; 0: none
      integer :: sections = 0
      !> Number of values of the spectra recorded for each case
      integer :: spectra = 0
      !> Number of values recorded for each case besides its measures: those of its Poincare sections and spectra, or
      !> those that `run` computes
      integer :: extras = 0
      !> Procedure that computes a case; not associated: the case is a run
      procedure(case_interface), pointer, nopass :: run => null()
      !> Settings besides the scene on which the results of the cases depend, as text; unallocated: none
      character(:), allocatable :: remark
      !> Text of the plan, by which chunks on disk are recognised
      character(:), allocatable :: text
      !> Folder of the chunks
      character(:), allocatable :: path
   end type plan_t

contains

   !> Make the plan of a resolved scene.
   subroutine make_plan(scene, plan)
      !> A scene with &sweep
      type(scene_t), intent(in) :: scene
      !> The plan
      type(plan_t), intent(out) :: plan

      integer, allocatable :: places(:)
      integer :: i, k

      associate (sweep => scene%sweep)
         plan%is_grid = sweep%design == design_grid
         plan%cases = merge(sweep%count, 1, sweep%design == design_latin_hypercube)
         places = pack([(k, k=1, size(sweep%swept))], is_swept(sweep%swept))
         allocate (plan%axes(size(places)))
         do k = 1, size(places)
            associate (axis => plan%axes(k), swept => sweep%swept(places(k)))
               axis%parameter = swept%parameter
               axis%is_logarithmic = allocated(swept%log_range)
               axis%minimum = minval(values_given(swept))
               axis%maximum = maxval(values_given(swept))
               if (sweep%design == design_latin_hypercube) then
                  call draw_values(sweep%count, sweep%seed, axis)
               else if (allocated(swept%list)) then
                  axis%values = swept%list
               else
                  ! evenly spaced values, the ends of which are exact
                  axis%values = value_at_fraction(axis%minimum, axis%maximum, axis%is_logarithmic, &
                     [(real(i - 1, wp)/real(swept%points - 1, wp), i=1, swept%points)])
               end if
               if (is_follower(sweep, places(k))) then
                  ! index of the axis of the first of the parameters that are tied together
                  axis%leader = count(is_swept(sweep%swept(:minval(sweep%tied))))
               else if (plan%is_grid) then
                  plan%cases = plan%cases*size(axis%values)
               else
                  plan%cases = size(axis%values)
               end if
            end associate
         end do
         if (scene%wants_poincare) plan%sections = scene%poincare%keep
         plan%spectra = spectrum_size(scene)
         plan%extras = section_values*plan%sections + plan%spectra
         if (sweep%carry > 0) call make_chains(sweep, plan)
         plan%chunk_cases = cases_of_chunk(scene, plan%cases, plan%chain)
         plan%chunks = (plan%cases - 1)/plan%chunk_cases + 1
      end associate
   end subroutine make_plan

   !> Number of cases in a chunk: the requested number, or a number that is smaller for cases with more Poincare
   !> sections; always a multiple of the length of a chain.
   pure integer function cases_of_chunk(scene, cases, chain) result(number)
      type(scene_t), intent(in) :: scene
      !> Number of all cases
      integer, intent(in) :: cases
      !> Number of cases in a chain; 0: cases are independent
      integer, intent(in) :: chain

      integer, parameter :: target_chunks = 400, max_chunk_size = 16384
      integer :: minimum, max_cases, sections

      number = scene%sweep%chunk_cases
      if (number == 0) then
         sections = 0
         if (scene%wants_poincare) sections = scene%poincare%keep
         number = (cases - 1)/target_chunks + 1
         ! a case with many Poincare sections or spectra has several times as many values as a row of measures
         max_cases = max_chunk_size/max(1, (sections*section_values + spectrum_size(scene))/measure_count)
         minimum = min_chunk_size(scene, cases)
         if (chain == 0) number = min(max(number, minimum), max(max_cases, minimum))
      end if
      if (chain > 0) number = chain*((number - 1)/chain + 1)
   end function cases_of_chunk

   !> Minimum number of cases in a chunk. Writing a chunk costs as much time as some cheap cases, so cheap cases have
   !> large chunks; expensive cases have small chunks, so that they are written to disk soon. The cost of a case is
   !> estimated from the duration of the run and the numbers of modes, steps and stops.
   pure integer function min_chunk_size(scene, cases) result(minimum)
      type(scene_t), intent(in) :: scene
      !> Number of all cases, which must give enough chunks for many threads
      integer, intent(in) :: cases

      integer, parameter :: min_size = 10, max_size = 500, min_chunks = 20
      ! cost of a run of 20 tau with 16 degrees of freedom (duration times degrees of freedom), a fraction of a
      ! millisecond
      real(wp), parameter :: reference_cost = 320.0_wp
      real(wp) :: cost

      associate (run => scene%response)
         cost = max(run%duration, 1.0_wp)*real(2*max(scene%mesh%elements, 1), wp)
         if (run%method == method_newmark) cost = cost*max(0.01_wp/run%step, 1.0_wp)
      end associate
      cost = cost*real(max(1, size(stops_of(run_settings_of(scene)))), wp)**2
      minimum = max(min_size, min(nint(real(max_size, wp)*min(1.0_wp, reference_cost/cost)), cases/min_chunks))
   end function min_chunk_size

   !> Make the chains of a sweep: the parameter `carry` becomes the axis that varies fastest, so that the cases of a
   !> chain are successive.
   subroutine make_chains(sweep, plan)
      type(sweep_settings_t), intent(in) :: sweep
      type(plan_t), intent(inout) :: plan

      type(axis_t) :: axis
      integer :: i, k

      plan%goes_back = sweep%carries_back
      if (plan%is_grid) then
         ! index of the axis of the parameter `carry`
         k = count(is_swept(sweep%swept(:sweep%carry)))
         axis = plan%axes(k)
         do i = k, size(plan%axes) - 1
            plan%axes(i) = plan%axes(i + 1)
         end do
         plan%axes(size(plan%axes)) = axis
      end if
      ! append the values in reverse order: in a grid those of the last axis, otherwise of all axes
      do k = 1, size(plan%axes)
         if (.not. plan%goes_back .or. (plan%is_grid .and. k < size(plan%axes))) cycle
         plan%axes(k)%values = [plan%axes(k)%values, plan%axes(k)%values(size(plan%axes(k)%values):1:-1)]
      end do
      if (plan%goes_back) plan%cases = 2*plan%cases
      plan%chain = size(plan%axes(size(plan%axes))%values)
   end subroutine make_chains

   !> Draw one value in each of as many strata as there are cases, in random order.
   subroutine draw_values(cases, seed, axis)
      !> Number of cases
      integer, intent(in) :: cases
      integer, intent(in) :: seed
      !> On entry with its range; on return with its values
      type(axis_t), intent(inout) :: axis

      type(random_t) :: random
      integer, allocatable :: stratum(:)
      real(wp) :: place
      integer :: i

      allocate (axis%values(cases), stratum(cases))
      call start_random(seed, axis%parameter%order, random)
      call shuffle(random, stratum)
      do i = 1, cases
         call next_random(random, place)
         axis%values(i) = value_at_fraction(axis%minimum, axis%maximum, axis%is_logarithmic, &
            (real(stratum(i) - 1, wp) + place)/real(cases, wp))
      end do
   end subroutine draw_values

   !> Whether a value lies at an end of the range of a parameter: at or beyond the minimum or maximum value of the
   !> cases.
   pure logical function is_at_end(axis, value) result(answer)
      type(axis_t), intent(in) :: axis
      real(wp), intent(in) :: value

      answer = axis%maximum > axis%minimum .and. (value <= minval(axis%values) .or. value >= maxval(axis%values))
   end function is_at_end

   !> The value of a parameter at a fraction of its range; the end of the range is exact.
   elemental real(wp) function value_at_fraction(minimum, maximum, is_logarithmic, fraction) result(value)
      !> Range of the parameter
      real(wp), intent(in) :: minimum
      real(wp), intent(in) :: maximum
      !> Whether the fraction is one of the logarithm of the range
      logical, intent(in) :: is_logarithmic
      !> 0 at the minimum, 1 at the maximum
      real(wp), intent(in) :: fraction

      if (is_logarithmic) then
         value = minimum*(maximum/minimum)**fraction
      else
         value = minimum + (maximum - minimum)*fraction
      end if
      value = min(max(value, minimum), maximum)
      if (fraction >= 1.0_wp) value = maximum
   end function value_at_fraction

   !> The fraction of a range at a value, the inverse of `value_at_fraction`.
   elemental real(wp) function fraction_at_value(minimum, maximum, is_logarithmic, value) result(fraction)
      !> Range of the parameter
      real(wp), intent(in) :: minimum
      real(wp), intent(in) :: maximum
      !> Whether the fraction is one of the logarithm of the range
      logical, intent(in) :: is_logarithmic
      real(wp), intent(in) :: value

      if (is_logarithmic) then
         fraction = log(value/minimum)/log(maximum/minimum)
      else
         fraction = (value - minimum)/(maximum - minimum)
      end if
   end function fraction_at_value

   !> The parameters of a case, in the order of the axes.
   pure subroutine case_values(plan, case, values)
      type(plan_t), intent(in) :: plan
      !> Number of the case, from 1
      integer, intent(in) :: case
      !> Values of the parameters, [axes]
      real(wp), intent(out) :: values(:)

      integer :: k, place(size(plan%axes)), remainder

      place = case
      remainder = case - 1
      do k = size(plan%axes), 1, -1
         if (.not. plan%is_grid .or. plan%axes(k)%leader > 0) cycle
         place(k) = modulo(remainder, size(plan%axes(k)%values)) + 1
         remainder = remainder/size(plan%axes(k)%values)
      end do
      do k = 1, size(plan%axes)
         if (plan%axes(k)%leader > 0) place(k) = place(plan%axes(k)%leader)
         values(k) = plan%axes(k)%values(place(k))
      end do
   end subroutine case_values

   !> The first case of a chunk.
   pure integer function first_of_chunk(plan, chunk) result(case)
      type(plan_t), intent(in) :: plan
      !> Number of the chunk, from 1
      integer, intent(in) :: chunk

      case = (chunk - 1)*plan%chunk_cases + 1
   end function first_of_chunk

   !> The last case of a chunk.
   pure integer function last_of_chunk(plan, chunk) result(case)
      type(plan_t), intent(in) :: plan
      !> Number of the chunk, from 1
      integer, intent(in) :: chunk

      case = int(min(int(chunk, i8)*int(plan%chunk_cases, i8), int(plan%cases, i8)))
   end function last_of_chunk

   !> The text of a plan: all settings on which the results of the cases depend, one name in each line, with numbers
   !> that are exact when read again. Two runs continue the same sweep only if their texts are equal.
   subroutine plan_text(scene, plan, text)
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(in) :: plan
      !> Lines, each ended by new_line('a')
      character(:), allocatable, intent(out) :: text

      character, parameter :: next = new_line('a')
      integer :: i, k

      text = program_name//' '//program_version//next//'columns'
      do k = 1, measure_count
         text = text//' '//trim(measure_table(k)%name)
      end do
      text = text//next
      do i = 1, size(scene%echo)
         associate (entry => scene%echo(i))
            ! these groups do not change the results of the cases, nor does `estimate` of &mesh
            if (entry%group == 'scene' .or. entry%group == 'best') cycle
            if (entry%group == 'mesh' .and. entry%name == 'estimate') cycle
            text = text//'&'//entry%group//' '//entry%name//' = '
            if (allocated(entry%number)) then
               text = text//list_of_numbers(entry%number)
            else
               text = text//entry%text
            end if
            text = text//next
         end associate
      end do
      ! these lines follow from the settings, and a message shows the first line that differs
      text = text//'cases '//to_text(plan%cases)//' in parts of '//to_text(plan%chunk_cases)//next
      if (allocated(plan%remark)) text = text//plan%remark//next
   end subroutine plan_text

   !> Numbers as text; a long list is represented by its first and last number and its checksum.
   function list_of_numbers(numbers) result(text)
      real(wp), intent(in) :: numbers(:)
      character(:), allocatable :: text

      integer, parameter :: max_listed = 100
      integer :: i

      if (size(numbers) <= max_listed) then
         text = ''
         do i = 1, size(numbers)
            text = text//' '//to_text(numbers(i))
         end do
         return
      end if
      text = ' '//to_text(numbers(1))//' ... '//to_text(numbers(size(numbers)))//', '//to_text(size(numbers)) &
         //' values, checksum '//to_text(checksum_of_numbers(numbers))
   end function list_of_numbers

end module sweep_plan
